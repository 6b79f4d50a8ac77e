"""What `pamrig simulate` does: records of commands, a simulator to answer them, one log each."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from rig.app.shipped import find_config
from rig.channels import FACT, common
from rig.columns import rms
from rig.errors import ConfigError
from rig.excite.run_plan import expand
from rig.excite.setpoints import around
from rig.excite.sweep import load_sweep
from rig.log.convert import write_record
from rig.log.log_files import is_mcap
from rig.log.reader import read
from rig.log.session_times import begun_s
from rig.model.external.simulator import KIND as EXTERNAL
from rig.model.parameters import Input, Model, load_model
from rig.model.resample import set_points
from rig.model.simulation import simulate
from rig.outputs import targets_in
from rig.own_units import own_plain
from rig.record import MAIN_COLUMNS, Record

ON_TIME = {"p50": 0.0, "p99": 0.0, "max": 0.0}
"""Lateness of a loop that nothing holds up, us: a simulation has no clock."""
_PLANT_PERIOD_S = 0.005
"""At which a sweep is laid out for a physics plant, s: the paper's rig. A record brings its own."""


@dataclass(frozen=True)
class Simulator:
    """Something that answers commands: a model, or a unit of the physics rig."""

    answer: Callable[[Record, float], Record]
    """The record, begun so many seconds after its session, with angle and pressures simulated."""
    period_s: float
    facts: dict[str, Any]
    """What the log says of it."""


@dataclass(frozen=True)
class Simulated:
    """One record that was simulated."""

    file: Path
    record: Record
    rmse_deg: float | None
    """Against the recorded angle, where there is one."""

    def to_json(self) -> dict[str, Any]:
        """One entry of `runs`, on time by nature like one on the virtual clock."""
        run: dict[str, Any] = {
            "file": str(self.file),
            "ticks": len(self.record),
            "missed": 0,
            "dropped": 0,
            "valid": True,
            "lateness_us": ON_TIME,
        }
        off: dict[str, Any] = {} if self.rmse_deg is None else {"rmse_deg": self.rmse_deg}
        return run | dict(own_plain(off, self.record.channels))


def by_model(path: Path, *, from_pressures: bool) -> Simulator:
    """The model at `path`, driven by the commands or by the pressures that were measured."""
    model = load_model(find_config(path, "models"))
    drive = Input.PRESSURE if from_pressures else Input.COMMAND
    facts = {"model": str(path), "drive": drive.value}

    def answer(record: Record, begun_s: float) -> Record:
        return answered(model, record, drive, str(path), sweep=record.source is None, begun_s=begun_s)

    return Simulator(answer, model.sample_time_s, facts)


def answered(model: Model, record: Record, drive: Input, name: str, *, sweep: bool, begun_s: float = 0.0) -> Record:
    """What the model called `name` says under a record's commands, with the model's channel map. RecordError for a
    record of another rig; a `sweep` is of no rig yet."""
    if not sweep and model.muscle.kind != EXTERNAL:
        common([(name, model.own_channels), (str(record.source or record.name), record.channels)])
    own = {} if model.channels is None else {FACT: model.channels.plain()}
    return simulate(model, replace(record, facts=dict(record.facts) | own), drive=drive, begun_s=begun_s)


def by_plant(family: str, unit: int, session: int) -> Simulator:
    """A unit of the physics rig, which measures like a real one: noise, counts, a monitor's bias."""
    from hil.reference import families

    plant = families.unit(family, unit)
    day = plant.session(session)

    def answer(record: Record, _begun_s: float) -> Record:
        p1, p2 = set_points(record, float(record.facts.get("p0_mpa") or 0.2))
        made = plant.simulate(p1, p2, record.period_s, day, noise_seed=sum(record.name.encode()))
        measured: dict[str, Any] = {name: made[name] for name in MAIN_COLUMNS if name not in ("t_s", "dp_cmd_mpa")}
        return replace(record, extra={}, **measured)

    return Simulator(answer, _PLANT_PERIOD_S, {"plant": unit, "session": f"{family} {unit}, day {session}"})


def simulate_all(commands: Path, simulator: Simulator, output: Path) -> Iterator[Simulated]:
    """Every record of the commands through the simulator, each written where it belongs: one into a .mcap, several into
    a folder."""
    records = commands_of(commands, simulator.period_s)
    one = len(records) == 1 and is_mcap(output)
    files = [output] if one else targets_in(output, (record.name for record in records), ".mcap")
    for record, file, at_s in zip(records, files, begun_s(records).tolist(), strict=True):
        simulated = simulator.answer(record, at_s)
        file.parent.mkdir(parents=True, exist_ok=True)
        write_record(simulated, file, {"simulated": True, "valid": True, **simulator.facts})
        yield Simulated(file, simulated, _rmse_deg(record, simulated))


def commands_of(commands: Path, period_s: float) -> list[Record]:
    """The commands as records: a sweep's at that period, or a log's own."""
    if commands.suffix.lower() not in (".yaml", ".yml") and (commands.exists() or commands.suffix):
        return read(commands)
    made = []
    for plan in expand(load_sweep(find_config(commands, "sweeps")), round(period_s * 1e9)):
        if plan.tracking is not None:
            raise ConfigError(f"{commands}: {plan.name} is an angle to follow, no command; see `pamrig track`")
        dp = np.array(plan.dp_mpa, dtype=np.float64)
        time_s = np.arange(len(dp), dtype=np.float64) * period_s
        made.append(Record(plan.name, time_s, dp, None, *around(plan.p0_mpa, dp), facts=plan.facts))
    return made


def _rmse_deg(record: Record, simulated: Record) -> float | None:
    if record.angle_deg is None or simulated.angle_deg is None:
        return None
    error = simulated.angle_deg - record.angle_deg
    return rms(error[np.isfinite(error)])
