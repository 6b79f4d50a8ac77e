"""The options of `pamrig gap check` that several of its commands share."""

import functools
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import click

from rig.blind_check.modes import GROUPS, MOST_FOLLOW_UPS
from rig.cli.common import F
from rig.cli.gap.options import families_option, path_type, workers_option

folder_argument = click.argument("folder", type=path_type)
_cases = click.option("--cases", type=click.IntRange(4, 100_000), default=40, show_default=True, help="How many cases.")
_seed = click.option(
    "--seed", type=click.IntRange(0), help="Seed of the labels; default: a secret one, told after the score."
)
_development = click.option("--development", is_flag=True, help="Development cases: never the same as any scored ones.")
_records = click.option(
    "--records",
    type=path_type,
    metavar="FOLDER",
    help="Put effects of sensor and time base into these records (folders: a session each) in place of a plant's.",
)
_modes = click.option(
    "--modes",
    multiple=True,
    type=click.Choice(tuple(GROUPS)),
    help="What the diagnosis is given, only this: several earlier days, one, the model file's fingerprint, a simulator "
    "alone; withheld: a library without some classes. Repeatable.",
)
_priors = click.option(
    "--priors",
    type=click.Path(path_type=Path, exists=True, dir_okay=False),
    metavar="FILE",
    help="Diagnose by the priors of this file, which `pamrig gap calibrate` wrote, in place of the shipped ones.",
)
_no_angle = click.option(
    "--no-angle", is_flag=True, help="Leave out the questions in which the measured pressures are withheld."
)
dask_option = click.option(
    "--dask", metavar="ADDRESS", help="Use the Dask cluster at ADDRESS; its workers must see the same folder."
)
experiments_option = click.option(
    "--experiments",
    type=click.IntRange(0, MOST_FOLLOW_UPS),
    default=MOST_FOLLOW_UPS,
    show_default=True,
    help="How many recommended experiments each answer may ask for, one after the other.",
)
_sweep = click.option(
    "--sweep",
    type=click.Path(path_type=Path),
    metavar="SWEEP.yaml",
    help="Record every day under this session, in place of excitations drawn for each unit.",
)
_own_zero = click.option(
    "--own-zero",
    is_flag=True,
    help="Each record takes the angle at rest for zero, as those of `pamrig run` do: it says nothing of what turns the "
    "joint there.",
)


def former_source_options(command: F) -> F:
    """What `score` had to be told of the cases before it read it from their labels: still understood, in no help."""
    help_text = "Understood and not needed: the labels say it."
    for option in (
        click.option("--development", is_flag=True, hidden=True, expose_value=False, help=help_text),
        click.option("--records", type=path_type, metavar="FOLDER", hidden=True, expose_value=False, help=help_text),
    ):
        command = option(command)
    return command


@dataclass(frozen=True)
class Drawn:
    """Which cases are drawn, and who works on them: one field an option of `drawn_options`."""

    cases: int
    seed: int | None
    development: bool
    families: tuple[str, ...]
    records: Path | None
    modes: tuple[str, ...]
    sweep: Path | None
    own_zero: bool
    no_angle: bool
    priors: Path | None
    dask: str | None
    workers: int | None


def drawn_options(command: Callable[..., None]) -> Callable[..., None]:
    """The options by which cases are drawn, passed to the command together as `drawn`."""

    @functools.wraps(command)
    def gathered(*arguments: Any, **options: Any) -> None:
        drawn = Drawn(**{field.name: options.pop(field.name) for field in fields(Drawn)})
        command(*arguments, drawn=drawn, **options)

    # decorators are applied from the last to the first, and the help lists the last applied on top
    for option in (
        workers_option, dask_option, _priors, _no_angle, _own_zero, _sweep, _modes, _records, families_option,
        _development, _seed, _cases,
    ):  # fmt: skip
        gathered = option(gathered)
    return gathered
