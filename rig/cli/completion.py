"""Completion in the shell: commands and options by click, files by what an argument takes."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import click
from click.shell_completion import CompletionItem

from rig.cli.outputs import Command, Output
from rig.outputs import OutputKind

LOGS: Final = (".mcap", ".csv", ".csv.gz", ".tdms")
YAML: Final = (".yaml", ".yml")
ANY: Final = ("",)
FOLDERS: Final = ()
SUFFIXES: Final[dict[str, tuple[str, ...]]] = {
    **dict.fromkeys(("log", "logs", "log_file", "baselines", "a", "b"), LOGS),
    **dict.fromkeys(
        ("model", "former_model", "beside", "start", "augmented", "rig", "rig_path", "sweep", "sweeps", "first"), YAML
    ),
    **dict.fromkeys(("mapping_path", "gate", "reference", "tracking", "config", "config_path"), YAML),
    **dict.fromkeys(("folder", "folders", "root", "records", "other"), FOLDERS),
    "commands": (*LOGS, *YAML),
    "files": (".csv", ".csv.gz", ".lvm", ".txt", ".tdms", ".mcap", ".parquet", ".mat"),
    "model_path": (*YAML, ".fmu"),
    **dict.fromkeys(("labels", "against"), (".json",)),
    "priors": YAML,
    "points": YAML,
    "state": FOLDERS,
    "socket": (".sock",),
}
"""Name of a parameter that takes files -> how these end; others take any."""
OURS: Final = {
    "rig": "rigs", "rig_path": "rigs", "sweep": "sweeps", "sweeps": "sweeps", "first": "sweeps", "commands": "sweeps",
    "model_path": "models",
}  # fmt: skip
"""Name of a parameter -> the folder of pamrig's own files that it takes by their name."""
WRITTEN: Final = {
    OutputKind.JSON: (".json",), OutputKind.PAGE: (".html",), OutputKind.FIGURE: (".png", ".svg", ".pdf"),
    OutputKind.RECORDING: (".mcap",), OutputKind.MODEL: YAML, OutputKind.SWEEP: YAML, OutputKind.CALIBRATION: YAML,
    OutputKind.LEVELS: YAML, OutputKind.RIG: YAML, OutputKind.FOLDER: (), OutputKind.TABLE: (".csv", ".md"),
    OutputKind.MAPPING: YAML, OutputKind.HUNT: (".json",), OutputKind.METRICS: (".prom",),
}  # fmt: skip
"""Kind of an output -> how its files end."""
SHELLS: Final = ("bash", "zsh", "fish")


@click.command(cls=Command)
@click.argument("shell", type=click.Choice(SHELLS))
def completion(shell: str) -> None:
    """Print what SHELL has to read: `eval "$(pamrig completion bash)"` in your ~/.bashrc, or the like for zsh; for fish
    into ~/.config/fish/completions/pamrig.fish."""
    from click.shell_completion import get_completion_class

    made = get_completion_class(shell)
    assert made is not None
    click.echo(made(click.get_current_context().find_root().command, {}, "pamrig", "_PAMRIG_COMPLETE").source())


def with_files(command: click.Command) -> click.Command:
    """The command, and those below it, with files completed by what each parameter takes."""
    for param in command.params:
        if isinstance(param.type, click.Path | Output):
            param._custom_shell_complete = files  # noqa: SLF001  # what `shell_complete=` of each one would set
    if isinstance(command, click.Group):
        for below in command.commands.values():
            with_files(below)
    return command


def files(_: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Folders, files that end as the parameter wants them, and the names of pamrig's own."""
    endings = _endings(param)
    return [*_named(param, incomplete), *_found(incomplete, endings)]


def _endings(param: click.Parameter) -> tuple[str, ...]:
    if isinstance(param.type, Output):
        return WRITTEN[param.type.kind]
    return SUFFIXES.get(param.name or "", ANY)


def _found(incomplete: str, endings: tuple[str, ...]) -> Iterator[CompletionItem]:
    folder, _, start = incomplete.rpartition("/")
    place = Path(f"{folder}/" if incomplete.startswith("/") and not folder else folder or ".").expanduser()
    try:
        entries = sorted(os.scandir(place), key=lambda entry: entry.name)
    except OSError:
        return
    before = incomplete[: len(incomplete) - len(start)]
    for entry in entries:
        if not entry.name.startswith(start) or (entry.name.startswith(".") and not start):
            continue
        if entry.is_dir():
            yield CompletionItem(f"{before}{entry.name}/", type="plain")
        elif endings and entry.name.endswith(endings):
            yield CompletionItem(f"{before}{entry.name}", type="plain")


def _named(param: click.Parameter, incomplete: str) -> Iterator[CompletionItem]:
    folder = OURS.get(param.name or "")
    if folder is None or "/" in incomplete:
        return
    from rig.app.shipped import configs

    for one in sorted((configs() / folder).glob("*.yaml")):
        if one.stem.startswith(incomplete):
            yield CompletionItem(one.stem)
