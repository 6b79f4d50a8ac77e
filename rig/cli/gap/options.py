"""Options that several commands of `pamrig gap` have: what stands for the rig without a gap, how it is seen, on
which plants, where the page goes, and who works on it."""

from collections.abc import Callable
from pathlib import Path
from typing import Final

import click

from rig.cli.common import F, family_option
from rig.cli.outputs import FORMERLY_OUTPUT, Output, Renamed
from rig.outputs import OutputKind

_AS_DIAGNOSED: Final = "What stands for the rig without a gap, as in `pamrig gap diagnose`."

workers_option = click.option("--workers", type=click.IntRange(1), help="Local processes; default: one a core.")
path_type = click.Path(path_type=Path, resolve_path=True)
"""Made absolute here: whoever answers works in another folder than the caller."""
families_option = family_option("Plants of this family only. Repeatable.")
_HTML: Final = "Write the page to FILE; a .md gets its tables."
html_option = click.option("--html", "html_to", type=Output(OutputKind.PAGE), metavar="FILE", help=_HTML)
page_option = click.option(
    "--html", "html_to", cls=Renamed, former=FORMERLY_OUTPUT, type=Output(OutputKind.PAGE), metavar="FILE", help=_HTML
)
"""The same, where `-o` is still understood."""


def baseline_option(text: str) -> Callable[[F], F]:
    """Adds `--baseline LOG`, repeatable, passed on as `baselines`, and `--every-day`."""
    given = click.option(
        "--baseline", "baselines", multiple=True, type=click.Path(path_type=Path), metavar="LOG", help=text
    )
    every = click.option(
        "--every-day", is_flag=True, help="Keep earlier days that disagree with the others; they are left out else."
    )
    return lambda command: given(every(command))


def reference_option(text: str = _AS_DIAGNOSED) -> Callable[[F], F]:
    """Adds `--reference`."""
    kinds = click.Choice(["auto", "sessions", "session", "fingerprint", "simulator"])
    return click.option("--reference", type=kinds, default="auto", help=text)


def angle_alone_option(command: F) -> F:
    """Adds `--no-pressures`."""
    text = "Use the angle alone, even where pressures were measured."
    return click.option("--no-pressures", is_flag=True, help=text)(command)
