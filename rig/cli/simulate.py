"""`pamrig simulate`: what the simulator says under the commands of a sweep or of logs."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rig.app.terminal import console
from rig.cli.common import emit, json_option

if TYPE_CHECKING:
    from rig.record import Record

Simulator = Callable[["Record"], "Record"]


@click.command()
@click.argument("commands", type=click.Path(path_type=Path), metavar="SWEEP.yaml|LOG")
@click.option("--model", "model_path", type=click.Path(path_type=Path), metavar="MODEL.yaml", help="The simulator.")
@click.option(
    "--plant", type=click.IntRange(0), metavar="UNIT", help="Instead of a model: that unit of the physics rig of hil.reference."
)
@click.option("--family", default="mckibben", show_default=True, help="The physics rig's family: mckibben or fluidic.")
@click.option(
    "--session", default=1, show_default=True, type=click.IntRange(0), help="The physics rig's day; each drifts a little."
)
@click.option(
    "-o",
    "--output",
    required=True,
    type=click.Path(path_type=Path),
    metavar="OUT.mcap",
    help="File, or a folder for several records.",
)
@click.option("--from-pressures", is_flag=True, help="Drive the muscles by the pressures measured in LOG, not by its commands.")
@click.option(
    "--loops",
    type=click.Path(path_type=Path),
    metavar="FILE.png",
    help="Draw all loops in one figure, as in Fig. 1 of the paper.",
)
@json_option
def simulate(commands: Path, output: Path, json_to: str | None, **wish: Any) -> None:
    """What MODEL says under the commands of a sweep or of a LOG: the angle, and the pressures if it has regulators.

    A model with added effects is a model. Several records go into the folder OUT, one file each. With --plant the records come
    from a physics simulation that shares no law with the models: something to identify that is not a Bouc-Wen model.
    """
    from rig.log.convert import write_record

    if (wish["model_path"] is None) == (wish["plant"] is None):
        raise click.UsageError("name either a --model or a --plant")
    say, period_s, facts = _by_plant(wish) if wish["model_path"] is None else _by_model(wish)
    records = _records(commands, period_s)
    runs: list[dict[str, Any]] = []
    said: list[Record] = []
    for record in records:
        simulated = say(record)
        said.append(simulated)
        file = output if len(records) == 1 and output.suffix == ".mcap" else output / f"{record.name}.mcap"
        file.parent.mkdir(parents=True, exist_ok=True)
        write_record(simulated, file, {"simulated": True, **facts})
        runs.append(_summary(file, record, simulated))
    terminal = console(json_to)
    for each in runs:
        compared = f", RMSE against the recording {each['rmse_deg']:.3f} deg" if "rmse_deg" in each else ""
        terminal.print(f"{each['file']}: {each['ticks']} ticks{compared}")
    if wish["loops"] is not None:
        from rig.report.fit_figures import loops_figure, save_figure

        save_figure(loops_figure(output.name, said), wish["loops"])
        terminal.print(f"loops: {wish['loops']}")
    emit({"runs": runs}, json_to)


def _by_model(wish: dict[str, Any]) -> tuple[Simulator, float, dict[str, Any]]:
    """The model as a function of a record, its sample time, and what the log should say of it."""
    from rig.app.compose import find_config
    from rig.model.kernels import simulate as run
    from rig.model.parameters import Input, load_model

    model = load_model(find_config(wish["model_path"], "models"))
    drive = Input.PRESSURE if wish["from_pressures"] else Input.COMMAND
    return (
        lambda record: run(model, record, drive=drive),
        model.sample_time_s,
        {"model": str(wish["model_path"]), "drive": drive.value},
    )


def _by_plant(wish: dict[str, Any]) -> tuple[Simulator, float, dict[str, Any]]:
    """The same for a unit of the physics rig, which measures like a real one: noise, counts, a monitor's bias."""
    from dataclasses import replace

    from hil.reference.families import unit
    from rig.model.resample import set_points
    from rig.record import MAIN_COLUMNS

    plant = unit(wish["family"], wish["plant"])
    day = plant.session(wish["session"])

    def say(record: "Record") -> "Record":
        p1, p2 = set_points(record, float(record.facts.get("p0_mpa") or 0.2))
        made = plant.simulate(p1, p2, record.period_s, day, noise_seed=sum(record.name.encode()))
        measured: dict[str, Any] = {name: made[name] for name in MAIN_COLUMNS if name not in ("t_s", "dp_cmd_mpa")}
        return replace(record, extra={}, **measured)

    return say, 0.005, {"plant": wish["plant"], "session": f"{wish['family']} {wish['plant']}, day {wish['session']}"}


def _records(commands: Path, period_s: float) -> "list[Record]":
    """The commands as records: a sweep's at that period, or a log's own."""
    from rig.app.compose import find_config

    if commands.suffix not in (".yaml", ".yml") and (commands.exists() or commands.suffix):
        from rig.log.reader import read

        return read(commands)
    import numpy as np

    from rig.excite.experiment import expand, load_sweep
    from rig.excite.setpoints import around
    from rig.record import Record

    period_ns = round(period_s * 1e9)
    made = []
    for plan in expand(load_sweep(find_config(commands, "sweeps")), period_ns):
        dp = np.array(plan.dp_mpa, dtype=np.float64)
        time_s = np.arange(len(dp), dtype=np.float64) * period_s
        made.append(Record(plan.name, time_s, dp, None, *around(plan.p0_mpa, dp), facts=plan.facts))
    return made


def _summary(file: Path, record: "Record", simulated: "Record") -> dict[str, Any]:
    """One entry of `runs`, on time by nature like one on the virtual clock; with the RMSE where the angle was recorded."""
    import numpy as np

    on_time = {"p50": 0.0, "p99": 0.0, "max": 0.0}
    entry: dict[str, Any] = {
        "file": str(file),
        "ticks": len(record),
        "missed": 0,
        "dropped": 0,
        "valid": True,
        "lateness_us": on_time,
    }
    if record.angle_deg is not None and simulated.angle_deg is not None:
        from rig.columns import rms

        error = simulated.angle_deg - record.angle_deg
        entry["rmse_deg"] = rms(error[np.isfinite(error)])
    return entry
