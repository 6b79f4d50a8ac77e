"""Making a check: labels drawn and sealed first, then the questions, unit by unit.

The model of each unit is identified here on its first healthy day, by the project's own identification; the case's
records are never used for it.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from random import Random
from typing import Any, Final

from rig.blind_check.folder import (
    FORMAT,
    MODEL_FILES,
    CheckFolder,
    link_day,
    read_json,
    token_of,
    without_times,
    write_day,
    write_json,
    write_truth,
)
from rig.blind_check.modes import MODES, OWN, SISTER, asked, names_of
from rig.blind_check.seal import new_key, open_sealed, seal
from rig.blind_check.source import BenchData, Label, Source, records_of
from rig.errors import RecordError
from rig.model.parameters import Model, save_model
from rig.record import Record

WITHHELD_SHARE: Final = 1 / 3
"""Of all classes, what the mode `withheld` does without. More: little is left to be mistaken for; less: few cases lack
theirs."""


@dataclass(frozen=True)
class BenchCases:
    """The cases of one bench: what one piece of making does."""

    source: Source
    folder: CheckFolder
    labels: tuple[Label, ...]
    tokens: tuple[str, ...]
    left_out: tuple[tuple[str, ...], ...]
    """Case by case: effects that the mode `withheld` does without."""
    modes: tuple[str, ...]
    """Modes of the check."""


def draw(
    source: Source,
    root: Path,
    seed: int,
    cases: int,
    modes: Sequence[str] = names_of(("days",)),
    key: bytes | None = None,
) -> str:
    """Draw and seal the labels of a new check at `root`; returns the hash, to be printed before anything else happens.

    A check that is already there must be of the same seed, size, modes and source (then it is resumed); RecordError
    otherwise.
    """
    folder = CheckFolder(root)
    sheet: dict[str, Any] = {"seed": seed, "cases": source.sheet(seed, cases), "modes": list(modes)}
    sheet |= {"recorded_under": source.recorded_under} if source.recorded_under else {}
    sheet["left_out"] = [left_out(seed, number) for number in range(cases)]
    if folder.sealed.exists():
        public = read_json(folder.sealed)
        if seal(sheet, bytes(32)).sha256 != public["sealed_sha256"]:
            raise RecordError(
                f"{root}: holds another check ({public['cases']} cases); choose another folder, or ask as it was asked"
            )
        return str(public["sealed_sha256"])
    key = key or new_key()
    sealed = seal(sheet, key)
    folder.maker.mkdir(parents=True, exist_ok=True)
    (folder.maker / "labels.sealed").write_bytes(sealed.blob)
    (folder.maker / "key").write_text(key.hex() + "\n", encoding="ascii")
    (folder.maker / "key").chmod(0o600)
    write_json(folder.sealed, {"format": FORMAT, "sealed_sha256": sealed.sha256, "cases": cases, "modes": list(modes)})
    return sealed.sha256


def open_labels(folder: CheckFolder) -> tuple[dict[str, Label], int]:
    """Token -> label of the whole check, and its seed; RecordError when the seal does not hold."""
    sheet, tokens = _opened(folder)
    return dict(zip(tokens, sheet["cases"], strict=True)), int(sheet["seed"])


def _opened(folder: CheckFolder) -> tuple[dict[str, Any], list[str]]:
    """The sealed sheet, and the token of each of its cases."""
    public = read_json(folder.sealed)
    where = folder.maker / "labels.sealed"
    try:
        key, blob = bytes.fromhex((folder.maker / "key").read_text(encoding="ascii")), where.read_bytes()
    except OSError as error:
        raise RecordError(f"{where}: cannot be read: {error.strerror}; labels and key are the maker's") from None
    sheet = open_sealed(blob, key, public["sealed_sha256"], str(where))
    return sheet, [token_of(key, number) for number in range(len(sheet["cases"]))]


def units(source: Source, folder: CheckFolder) -> list[BenchCases]:
    """The check's cases by bench."""
    sheet, tokens = _opened(folder)
    grouped: dict[str, list[int]] = {}
    for number, label in enumerate(sheet["cases"]):
        grouped.setdefault(source.bench_key(label), []).append(number)

    def picked(items: Sequence[Any], numbers: Sequence[int]) -> tuple[Any, ...]:
        return tuple(items[number] for number in numbers)

    return [
        BenchCases(
            source,
            folder,
            picked(sheet["cases"], numbers),
            picked(tokens, numbers),
            picked(sheet["left_out"], numbers),
            tuple(sheet["modes"]),
        )
        for numbers in grouped.values()
    ]


def make_unit(unit: BenchCases) -> list[str]:
    """Write the questions and truths of one unit's cases that are not made yet; returns their tokens."""
    missing = [number for number, token in enumerate(unit.tokens) if not made(unit.folder, token)]
    if not missing:
        return []
    bench = unit.source.bench(unit.labels[missing[0]])
    shared = unit.folder.maker / "benches" / unit.source.bench_key(unit.labels[0])
    for number, day in enumerate(bench.baselines, 1):
        write_day(day, shared / f"day_{number}")
    models = {MODES[mode].model for label in unit.labels for mode in asked(unit.modes, label)}
    write_models(bench, models | {OWN}, shared)
    for number in missing:
        _make_case(unit, number, bench, shared)
    return [unit.tokens[number] for number in missing]


def made(folder: CheckFolder, token: str) -> bool:
    """Whether the case's question was written to its end: its truth comes last."""
    return folder.answer(token).exists() or (folder.truth(token).exists() and folder.question(token).exists())


def _make_case(unit: BenchCases, number: int, bench: BenchData, shared: Path) -> None:
    label, token = unit.labels[number], unit.tokens[number]
    place = unit.folder.question(token)
    data = unit.source.case(label)
    for day in range(1, int(label["baselines"]) + 1):
        link_day(shared / f"day_{day}", place / "baselines" / f"day_{day}")
    for given in (*sorted(shared.glob("*.yaml")), *([unit.folder.priors] if unit.folder.priors.exists() else ())):
        (place / given.name).write_bytes(given.read_bytes())
    write_day(data.records, place / "records")
    write_json(place / "question.json", {"modes": asked(unit.modes, label), "leave_out": list(unit.left_out[number])})
    without_times(place)
    write_truth(unit.folder.truth(token), data.facts, data.untouched, bench.untouched)


def left_out(seed: int, number: int) -> list[str]:
    """Effects to leave out of the library in the mode `withheld`: a third of all classes, by the sealed seed and the
    case's number alone.

    Its own class is missing as often for a case that has it as for one that has not, so that the question tells
    nothing.
    """
    from rig.gap.hypotheses.library import LIBRARY, effect_class

    classes = sorted({effect_class(effect, True) for effect in LIBRARY})
    gone = set(Random(f"left out of case {number} by {seed}").sample(classes, round(WITHHELD_SHARE * len(classes))))
    return [effect for effect in LIBRARY if effect_class(effect, True) in gone]


def write_models(bench: BenchData, kinds: Collection[str], place: Path) -> None:
    """The simulators that are asked about: the unit's own, identified on all of its first healthy day (from three sines
    alone it is off by a fifth in a chirp), the same without a fingerprint, and one identified on a sister's day,
    without a fingerprint too.
    """
    if all((place / MODEL_FILES[kind]).exists() for kind in kinds):
        return
    own = nominal_model(records_of(bench.baselines[0]), bench.p0_mpa)
    for kind in kinds:
        model = own if kind != SISTER else nominal_model(records_of(bench.sister), bench.p0_mpa)
        save_model(model if kind == OWN else without_fingerprint(model), place / MODEL_FILES[kind])


def without_fingerprint(model: Model) -> Model:
    """The same simulator as another tool or a data sheet would give it."""
    return replace(model, fingerprint=None)


def nominal_model(records: Sequence[Record], p0_mpa: float) -> Model:
    """A MBW from measured pressures with regulators (from commands where none were measured), by the swarm of Table II
    with an early stop."""
    from rig.identify.fit import SearchSettings, identify
    from rig.identify.records.data import RecordOptions
    from rig.identify.templates import Template, template_model
    from rig.model.parameters import Input

    drive = Input.PRESSURE if all(record.has_pressures for record in records) else Input.COMMAND
    start = template_model(Template(drive=drive, p0_mpa=p0_mpa, free_offset=True, mean_exponent=1.0))
    settings = SearchSettings(seeds=(1,), patience=60, bounded=False, workers=1)
    return identify(records, start, settings, RecordOptions(resample=True)).model
