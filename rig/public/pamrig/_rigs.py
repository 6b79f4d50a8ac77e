"""Running a rig: a sweep on it, or recorded commands once more."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, get_args

from pamrig._picture import Picture, Table, Tabled, shown
from pamrig._places import place_of, plain, require_one_of, sweep_file
from pamrig._records import Record, Records, read
from rig.app import compose, shipped
from rig.app.runs import record_folders, replaying
from rig.app.runs.outcome import RunOutcome
from rig.app.runs.sweeping import SweepOptions, run_sweep
from rig.config import structure, unstructure
from rig.errors import ConfigError
from rig.model.chain import place_effect, stage_of
from rig.model.parameters import AddedEffect
from rig.rig_config import RigConfig

Clock = Literal["real", "virtual"]
Effects = Mapping[str, Mapping[str, float]]
"""Effect of the library -> its numbers; `pamrig gap effects` lists them."""


@dataclass(frozen=True)
class Rig:
    """A rig to run on: its YAML, checked, and what stands instead of some of its settings."""

    config: RigConfig
    options: Mapping[str, Any] = field(default_factory=dict)
    seed: int | None = None

    @property
    def simulated(self) -> bool:
        """Nothing real moves."""
        return compose.is_simulated(self.config)

    def __repr__(self) -> str:
        added = [effect.effect for effect in self.options.get("effects", ())]
        parts = [self.config.name, f"{self.config.period_ns / 1e6:g} ms", "simulated" if self.simulated else "real"]
        parts += [f"seed {self.seed}"] if self.seed is not None else []
        return f"Rig({', '.join(parts)}{', with ' + ', '.join(added) if added else ''})"


def load_rig(place: str | Path) -> Rig:
    """The rig of a YAML file, or one that comes with pamrig by its name; ConfigError when it does not fit.

    >>> pamrig.load_rig("paper_myrio").simulated
    False
    """
    return Rig(compose.load(place_of(place, "rig")))


def simulated_rig(
    effects: Effects | None = None, *, seed: int = 1, drift: float | None = None, model: str | Path | None = None
) -> Rig:
    """The simulated rig, with effects that its model does not have: a rig that is not what its simulator says.

    `effects` maps effects of the library to their numbers. One `seed` is one day: its noise, and its gains and time
    constants, which wander by `drift` (relative standard deviation; None: as much as the rig's YAML says). `model`
    stands instead of its own.
    ModelError for an effect that does not exist, ConfigError for a seed or a drift that cannot be.

    >>> worn = pamrig.simulated_rig({"delay": {"delay_s": 0.02}}, seed=3)
    >>> worn.simulated
    True
    """
    added = _added(effects or {})
    options: dict[str, Any] = {"effects": added} | ({} if drift is None else {"drift": plain(drift)})
    seed = plain(seed)
    if model is not None:
        options["model"] = shipped.find_config(place_of(model, "model"), "models").resolve()
    config = compose.load(None)
    for entry in config.devices:
        compose.device_settings(entry, config, options | {"seed": seed})  # what cannot be set is said here
    return Rig(config, options, seed)


def _added(effects: Effects) -> list[AddedEffect]:
    if not isinstance(effects, Mapping):
        raise ConfigError(f"effects: expected a mapping of effects to their numbers, got {effects!r:.60}")
    return [_one_added(name, plain(numbers)) for name, numbers in effects.items()]


def _one_added(name: str, numbers: Any) -> AddedEffect:
    """One effect with its numbers; ModelError or ConfigError says which effect it is."""
    where = f"effects: {name}"
    size = stage_of(AddedEffect(name, {})).size
    if not isinstance(numbers, Mapping):
        raise ConfigError(f"{where}: expected a mapping of its numbers, {size!r} among them, got {numbers!r:.60}")
    added = structure({"effect": name, "parameters": numbers}, AddedEffect, where)
    place_effect(added, {})
    return added


class Runs(Tabled):
    """What came of runs: their files, whether they are valid, and their records.

    >>> runs = pamrig.run("quick", pamrig.simulated_rig(seed=7), out="other")
    >>> runs.valid, [file.name for file in runs.files]
    (True, ['sine_0.5hz_0.20mpa.mcap'])
    """

    def __init__(self, outcome: RunOutcome) -> None:
        self._outcome = outcome

    @property
    def files(self) -> list[Path]:
        """The recordings, in order."""
        return [run.file for run in self._outcome.runs]

    @property
    def valid(self) -> bool:
        """All that was planned was recorded, with no tick missed, none lost, no fault."""
        return len(self.files) == self._outcome.planned and all(run.valid for run in self._outcome.runs)

    @property
    def records(self) -> Records:
        """The sweeps that were recorded."""
        return read(*self.files)

    def judge(self) -> None:
        """CheckFailed, with the reason in one line, unless all is valid."""
        self._outcome.judge()

    def to_json(self) -> dict[str, Any]:
        """What `pamrig run --json` writes."""
        return self._outcome.to_json()

    def plot(self) -> Picture:
        """The records."""
        return self.records.plot()

    def _table(self) -> Table:
        rows = [
            (run.file.stem, run.ticks, run.missed, run.dropped, shown(run.lateness_us.get("p99")), run.valid)
            for run in self._outcome.runs
        ]
        return Table(("record", "ticks", "missed", "dropped", "late p99 [us]", "valid"), rows)


def run(
    sweep: str | Path | dict[str, Any],
    rig: Rig | str | Path | None = None,
    *,
    out: str | Path | None = None,
    clock: Clock | None = None,
    force: bool = False,
) -> Runs:
    """Run a sweep on a rig: settle, zero the angle, ramp, sweep, ramp out, safe state; one recording a record.

    `sweep` is a YAML file, the name of one that comes with pamrig, or a mapping with the keys of one. `rig` is the
    simulated rig by default, `out` a new folder under logs/. The `clock` is virtual (as fast as it can) on a simulated
    rig and real on a real one. EnvelopeError before anything moves when the sweep would leave the rig's envelope;
    CheckFailed when a run ended in a fault or is not valid. To be called from the main thread, which hears Ctrl-C.

    >>> sweep = {"duration_s": 2.0, "settle_s": 0.5, "records": [{"sine": {"frequency_hz": 1.0, "amplitude_mpa": 0.1}}]}
    >>> len(pamrig.run(sweep, pamrig.simulated_rig(seed=3), out="mine").records)
    1
    """
    chosen = _rig(rig)
    _check_clock(clock)
    virtual = clock == "virtual" if clock else chosen.simulated
    facts = {"effects": unstructure(chosen.options["effects"])} if chosen.options.get("effects") else {}
    folder = None if out is None else place_of(out, "out")
    with sweep_file(sweep) as path:
        options = SweepOptions(folder, virtual, chosen.seed, force, facts, chosen.options)
        runs = Runs(run_sweep(path, chosen.config, options))
    runs.judge()
    return runs


class Replay(Tabled):
    """Recorded commands once more: what came of them beside the recording.

    >>> (again,) = pamrig.replay("first", out="again")
    >>> again.rmse_deg < 0.1
    True
    """

    def __init__(self, done: replaying.Replayed) -> None:
        self._done = done
        self.file = done.file
        self.rmse_deg: float = done.comparison["rmse_deg"]
        self.max_deg: float = done.comparison["max_deg"]
        self.departures = list(done.departures)
        """Where it left the tolerances, one line each."""

    @property
    def record(self) -> Record:
        """The sweep of the replay."""
        record: Record = read(self.file)[0]
        return record

    def to_json(self) -> dict[str, Any]:
        """The entry of `pamrig replay --json`."""
        return self._done.to_json()

    def plot(self) -> Picture:
        """Recording and replay over time, their difference, both loops."""
        from rig.report.log_figures import replay_figure

        return Picture(replay_figure(self.file.stem, self._done.beside, self._done.channels))

    def _table(self) -> Table:
        own = self._done.channels
        numbers = [shown(own.output_per_deg * deg) for deg in (self.rmse_deg, self.max_deg)]
        head = ("replay", f"RMSE [{own.output.unit}]", f"max [{own.output.unit}]")
        return Table(head, [(self.file.stem, *numbers)])


def replay(
    log: str | Path,
    rig: Rig | str | Path | None = None,
    *,
    model: str | Path | None = None,
    out: str | Path | None = None,
    tolerances: Mapping[str, float] | None = None,
    clock: Clock | None = None,
    resample: bool = False,
    force: bool = False,
) -> list[Replay]:
    """Send the recorded commands of a log, or of each log in a folder, to a rig once more, and compare.

    `model` stands instead of the simulated rig's own. With `tolerances` (field -> largest difference) each replay says
    where it left them. RecordError when a recording does not fit the rig's period, unless `resample`.
    """
    chosen = _rig(rig)
    _check_clock(clock)
    config, simulator = None if rig is None else chosen.config, None if model is None else place_of(model, "model")
    job = replaying.prepare(place_of(log, "replay"), config, simulator, None, resample)
    job = replace(job, device_options={**chosen.options, **job.device_options})
    folder = place_of(out, "out") if out is not None else record_folders.new_folder("replay")
    options = replaying.ReplayOptions(folder, clock, chosen.seed, force, None, tolerances)
    done = list(replaying.replay_all(job, options))
    for item in done:
        item.outcome.judge()
    return [Replay(item) for item in done]


def _check_clock(clock: Clock | None) -> None:
    if clock is not None:
        require_one_of(clock, get_args(Clock), "clock")


def _rig(rig: Rig | str | Path | None) -> Rig:
    if isinstance(rig, Rig):
        return rig
    return Rig(compose.load(None)) if rig is None else load_rig(rig)
