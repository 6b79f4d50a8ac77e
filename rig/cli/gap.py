"""`pamrig gap`: diagnose the gap between simulator and rig, list the effects, and the blind check."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rig.cli.common import console, emit, json_option
from rig.cli.gap_check import check

if TYPE_CHECKING:
    from rig.gap.causes import Findings
    from rig.gap.result import Diagnosis
    from rig.log.record import Record
    from rig.model.parameters import Model

_path = click.Path(path_type=Path)


@click.group()
def gap() -> None:
    """Where the gap between simulator and rig lies, which effect causes it, how far it shrinks."""


gap.add_command(check)


@gap.command()
@click.option("--model", "model_path", required=True, type=_path, metavar="MODEL.yaml", help="The simulator.")
@click.option(
    "--log", "logs", required=True, multiple=True, type=_path, metavar="LOG", help="Records with the gap: files or folders."
)
@click.option(
    "--baseline", "baselines", multiple=True, type=_path, metavar="LOG", help="One session of the healthy rig; repeat for more."
)
@click.option("--html", "html_to", type=_path, metavar="FILE", help="Write the report as one HTML page.")
@click.option("--augmented-model", "augmented_to", type=_path, metavar="FILE", help="Write the simulator with the causes added.")
@click.option("--next-experiment", "next_to", type=_path, metavar="FILE", help="Write the recommended sweep, if there is one.")
@click.option("--no-pressures", is_flag=True, help="Use the angle alone, even where pressures were measured.")
@click.option("--effect", "effects", multiple=True, metavar="NAME", help="Limit the library to these effects.")
@json_option
def diagnose(model_path: Path, logs: tuple[Path, ...], baselines: tuple[Path, ...], json_to: str | None, **wish: Any) -> None:
    """Compare LOG with the healthy rig's BASELINE sessions (or, without any, with MODEL alone) and name the cause.

    A folder of several days as LOG gives one diagnosis a day, side by side.
    """
    from rig.model.parameters import load_model

    model = load_model(model_path)
    sessions = [_read(path) for path in baselines]
    cases = _cases(logs)
    results = {}
    for name, records in cases.items():
        diagnosis, findings = _diagnosed(model, records, sessions, wish)
        results[name] = diagnosis
        _show(diagnosis, name if len(cases) > 1 else None, json_to)
        _write(diagnosis, findings, model, wish, name if len(cases) > 1 else None)
    told = [diagnosis.to_json() for diagnosis in results.values()]
    emit(told[0] if len(told) == 1 else {"days": dict(zip(results, told, strict=True))}, json_to)


@gap.command()
@json_option
def effects(json_to: str | None) -> None:
    """List every effect: where it lies, its numbers with bounds, what it looks like, what it may be mistaken for."""
    from rich.table import Table

    from rig.gap.effects import LIBRARY, alike
    from rig.model.effect_stages import EFFECT_STAGES

    table = Table(
        "effect", "stage", "numbers", "looks like", "angle alone: like", "with pressures: like", box=None, pad_edge=False
    )
    told = {}
    for effect in LIBRARY.values():
        known = EFFECT_STAGES[effect.laws[0].stage]
        names = {name for law in effect.laws if law.stage == effect.laws[0].stage for name in law.free}
        numbers = [number for number in known.numbers if number.name in names]
        told[effect.name] = {
            "stage": effect.stage,
            "looks_like": effect.looks_like,
            "alike_angle_only": alike(effect.name, False),
            "alike_with_pressures": alike(effect.name, True),
            "parameters": {
                number.name: {
                    "unit": number.unit,
                    "low": number.low,
                    "high": number.high,
                    "neutral": number.neutral,
                    "meaning": number.meaning,
                }
                for number in known.numbers
            },
        }
        shown = ", ".join(f"{number.name} {number.low:g}..{number.high:g}" for number in numbers)
        table.add_row(
            effect.name,
            effect.stage,
            shown,
            effect.looks_like,
            ", ".join(alike(effect.name, False)),
            ", ".join(alike(effect.name, True)),
        )
    console(json_to).print(table)
    emit({"effects": told}, json_to)


def _read(path: Path) -> "list[Record]":
    from rig.log.reader import read

    return list(read(path))


def _cases(logs: tuple[Path, ...]) -> "dict[str, list[Record]]":
    """Case name -> its records; a single folder that holds nothing but folders is a campaign, one case each."""
    if len(logs) == 1 and logs[0].is_dir():
        inside = [entry for entry in sorted(logs[0].iterdir()) if not entry.name.startswith(".")]
        if inside and all(entry.is_dir() for entry in inside):
            return {entry.name: _read(entry) for entry in inside}
    return {logs[0].stem: [record for path in logs for record in _read(path)]}


def _diagnosed(
    model: "Model", records: "list[Record]", sessions: "list[list[Record]]", wish: dict[str, Any]
) -> "tuple[Diagnosis, Findings]":
    from rig.errors import ConfigError
    from rig.gap.diagnosis import diagnose_with_findings
    from rig.gap.effects import LIBRARY

    for name in wish["effects"]:
        if name not in LIBRARY:
            raise ConfigError(f"--effect: unknown effect {name!r}; allowed: {', '.join(LIBRARY)}")
    library = list(wish["effects"]) or None
    return diagnose_with_findings(model, records, sessions, pressures=not wish["no_pressures"], library=library)


def _write(diagnosis: "Diagnosis", findings: "Findings", model: "Model", wish: dict[str, Any], name: str | None) -> None:
    """Report, model and next sweep where they were asked for; one of several cases puts its name into the file's."""

    def place(path: Path) -> Path:
        return path if name is None else path.with_name(f"{path.stem}_{name}{path.suffix}")

    if wish["html_to"]:
        from rig.report.page import write_page

        write_page(place(wish["html_to"]), diagnosis, findings, model)
    if wish["augmented_to"]:
        from rig.gap.augment import augmented
        from rig.model.parameters import save_model

        save_model(augmented(model, diagnosis, findings.prepared.nominal), place(wish["augmented_to"]))
    if wish["next_to"] and diagnosis.next_experiment:
        from rig.errors import RigError

        try:
            place(wish["next_to"]).write_text(str(diagnosis.next_experiment["config"]), encoding="utf-8")
        except OSError as error:
            raise RigError(f"{place(wish['next_to'])}: cannot be written: {error.strerror}") from None


def _show(diagnosis: "Diagnosis", name: str | None, json_to: str | None) -> None:
    """The summary for a person."""
    from rich.table import Table

    from rig.gap.words import answers

    out = console(json_to)
    if name:
        out.print(f"[bold]{name}[/bold]")
    for question, answer in answers(diagnosis).items():
        out.print(f"[bold]{question}[/bold]  {answer}")
    if diagnosis.ranking:
        table = Table("effect", "stage", "judged on", "explains", "probability", box=None, pad_edge=False)
        for line in diagnosis.ranking[:6]:
            table.add_row(line.effect, line.stage, line.side, f"{100 * line.explained_fraction:.0f} %", f"{line.probability:.2f}")
        out.print(table)
    for note in diagnosis.notes:
        out.print(f"note: {note}")
