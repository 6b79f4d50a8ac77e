"""`pamrig bench gap`: the practice set across its two units, beside several days, one, or none; the time of a case; and
what simpler answers reach on the same records.

Labels are open here; the check on withheld data is `pamrig gap check`.
"""

import json
import os
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Final

from rig.channels import EFFECTS_FACT
from rig.errors import RecordError
from rig.qualify.benchmarks import figure, share
from rig.qualify.benchmarks.commands import pamrig

if TYPE_CHECKING:
    from rig.gap.answer.result import Diagnosis
    from rig.model.parameters import Model
    from rig.record import Record

PRACTICE_PLACES = ("../shared/practice",)
"""Where the practice set may lie, from the working folder; or the environment variable PAMRIG_PRACTICE."""
UNITS = ("unit_a", "unit_b")
_ALONE = "no other diagnosis of such a rig is known to measure beside"
CASES_A_UNIT: int | None = None
"""All."""
RECORDS: int | None = None
"""Of each session; all."""
ROWS: int | None = None
"""Of each record; all."""
EFFECTS: Sequence[str] | None = None
"""What these rigs can have; all of the library."""
UNTOUCHED = 2
"""Records of each case that are kept from the diagnosis to see how far the gap shrinks on them."""
SEARCH: tuple[str, ...] = ()
"""How each unit's simulator is searched on its first day, in the words of `pamrig identify`; its defaults."""


@dataclass(frozen=True)
class _Asked:
    """A way in which every case is asked."""

    name: str
    days: int
    """Earlier days at hand, the first ones."""
    simulator: str = ""
    """Of the unit itself, or of its sister; none."""
    pressures: bool = True


_BY_DAYS: Final = (_Asked("pressures", 4), _Asked("angle", 4, pressures=False))
_BY_SIMULATORS: Final = (
    _Asked("one day", 1, "own"), _Asked("fingerprint", 0, "own"), _Asked("sister's simulator", 0, "sister")
)  # fmt: skip


def bench_gap() -> dict[str, Any]:
    """Every row of the goals that the practice set can show, with pressures and from the angle alone, and the times."""
    practice = _practice()
    labels = {
        case: [one["effect"] for one in said]
        for case, said in json.loads((practice / "labels.json").read_text()).items()
    }
    data = {unit: _unit(practice, unit, labels) for unit in UNITS}
    simulators = {unit: _simulator(practice / unit / "baseline_1") for unit in UNITS}
    rows: dict[str, Any] = {}
    for asked in _BY_DAYS:
        rows |= {f"{name}, {asked.name}": row for name, row in _scored(data, asked, {}).items()}
        rows |= {f"{name}, {asked.name}": row for name, row in _held_out(data, asked.pressures).items()}
    for asked in _BY_SIMULATORS:
        rows |= {f"{name}, {asked.name}": row for name, row in _scored(data, asked, simulators).items()}
    return rows | _withheld(data) | _naive(data) | _times(data)


def _practice() -> Path:
    for place in (os.environ.get("PAMRIG_PRACTICE", ""), *PRACTICE_PLACES):
        if place and (Path(place) / "labels.json").is_file():
            return Path(place)
    raise RecordError("bench gap: no practice set; run beside ../shared/practice or set PAMRIG_PRACTICE to its folder")


def _unit(practice: Path, unit: str, labels: dict[str, list[str]]) -> dict[str, Any]:
    cases = {
        case: [name for name in names if name != "none"] for case, names in labels.items() if case.startswith(unit)
    }
    chosen = dict(list(cases.items())[:CASES_A_UNIT])
    return {
        "baselines": [_session(practice / unit / f"baseline_{k}") for k in (1, 2, 3, 4)],
        "cases": {case: (_session(practice / case), names) for case, names in chosen.items()},
    }


def _session(folder: Path) -> "list[Record]":
    from rig.log.reader import read

    able = {} if EFFECTS is None else {EFFECTS_FACT: list(EFFECTS)}
    records = [record.rows(slice(0, ROWS)) for record in read(folder)[:RECORDS]]
    return [replace(record, facts={**record.facts, **able}) for record in records]


def _simulator(day: Path) -> "Model":
    """Identified on a day; RigError when that fails."""
    from rig.model.parameters import load_model

    with TemporaryDirectory(prefix="pamrig-bench-") as folder:
        model = Path(folder) / "model.yaml"
        pamrig("identify", day, *SEARCH, "-o", model)
        return load_model(model)


def _scored(data: dict[str, Any], asked: _Asked, simulators: "Mapping[str, Model]") -> dict[str, Any]:
    """Goals over both units; a case is detected when something is found."""
    from rig.gap import diagnose

    sister = asked.simulator == "sister"
    whose = dict(zip(UNITS, reversed(UNITS) if sister else UNITS, strict=True))
    reference = "simulator" if sister else "auto"
    found = [
        (
            names,
            diagnose(
                simulators.get(whose[unit]), records, one["baselines"][: asked.days], pressures=asked.pressures,
                reference=reference,
            ),
        )
        for unit, one in data.items()
        for records, names in one["cases"].values()
    ]  # fmt: skip
    tally: dict[str, list[bool]] = {}
    sizes: list[int] = []
    for names, diagnosis in found:
        for figure_name, outcome in _outcomes(names, diagnosis, asked.pressures):
            tally.setdefault(figure_name, []).append(outcome)
        if len(names) == 1:
            sizes.append(len(_around(diagnosis)))
    closed = [diagnosis.gap.explained_fraction for names, diagnosis in found if names]
    lower = {"false alarms": {"better": "lower"}}
    rows = {name: share(outcomes, **lower.get(name, {})) for name, outcomes in tally.items()}
    rows["size of the set"] = figure(sum(sizes) / len(sizes), "names", limit="one name", limit_value=1.0)
    rows["gap closed, median"] = figure(
        100 * sorted(closed)[len(closed) // 2], "%", better="higher", limit="all of it", limit_value=100.0
    )
    return rows


def _outcomes(names: list[str], diagnosis: "Diagnosis", pressures: bool) -> Iterator[tuple[str, bool]]:
    """(figure, whether it was so) of one case on which `names` are wrong."""
    from rig.gap.answer.facts import Verdict
    from rig.gap.hypotheses.library import LIBRARY, effect_class

    seen = diagnosis.verdict is not Verdict.NONE
    if not names:
        yield "false alarms", seen
        return
    yield "detected", seen
    if len(names) > 1:
        yield "pairs, both right", {cause.effect for cause in diagnosis.causes} == set(names)
        return
    (name,) = names
    first = diagnosis.causes[0] if diagnosis.causes else None
    yield "stage right", first is not None and first.stage == LIBRARY[name].stage
    yield (
        "class first",
        first is not None
        and first.effect in LIBRARY
        and effect_class(first.effect, pressures) == effect_class(name, pressures),
    )
    yield "exact name first", first is not None and first.effect == name
    yield "truth in the set", name in _around(diagnosis)
    yield "known kept", first is not None and first.is_named


def _around(diagnosis: "Diagnosis") -> tuple[str, ...]:
    """The first cause and what it cannot be told from."""
    first = diagnosis.causes[0] if diagnosis.causes else None
    return (first.effect, *first.ambiguous_with) if first else ()


def _held_out(data: dict[str, Any], pressures: bool) -> dict[str, Any]:
    """How far the gap shrinks on two records that the diagnosis was never given, and whether that was predicted. By the
    description of the healthy rig: the set has no simulator of these rigs."""
    from rig.blind_check.score import EXCITED
    from rig.blind_check.statistics import CLOSE
    from rig.gap.diagnosis import diagnose_with_grounds
    from rig.gap.records.pairs import pair_up
    from rig.gap.reference.build import expect
    from rig.gap.reference.gaps import commanded_gaps, rms_of

    closed: list[float] = []
    near: list[bool] = []
    for one in data.values():
        for records, names in one["cases"].values():
            if not names:
                continue
            told, grounds = diagnose_with_grounds(None, records[:-UNTOUCHED], one["baselines"], pressures=pressures)
            kind, p0_mpa = grounds.expected.kind, grounds.expected.pairing.p0_mpa
            fresh = expect(
                kind, False, None, pair_up(records[-UNTOUCHED:], one["baselines"], p0_mpa, pressures=pressures)
            )
            before, after = (rms_of(commanded_gaps(fresh, causes), fresh.pairs) for causes in ([], told.added))
            floor = told.gap.floor_deg
            if told.added and before > EXCITED * floor:
                closed.append((before**2 - after**2) / (before**2 - floor**2))
                near.append(abs(closed[-1] - told.gap.explained_fraction) <= CLOSE)
    return {
        "gap closed on records never given, median": figure(
            100 * sorted(closed)[len(closed) // 2], "%", better="higher", limit="all of it", limit_value=100.0
        ),
        "the same, worst case": figure(100 * min(closed), "%", better="higher", limit="all of it", limit_value=100.0),
        "predicted within 0.05 of that": share(near),
    }


def _withheld(data: dict[str, Any]) -> dict[str, Any]:
    """Single effects with their own class taken out of the library: is something unknown said, or another name?"""
    from rig.blind_check.score import FLAGS
    from rig.gap import diagnose
    from rig.gap.hypotheses.library import LIBRARY, effect_class

    flagged = []
    for one in data.values():
        for records, names in one["cases"].values():
            if len(names) != 1:
                continue
            gone = effect_class(names[0], True)
            library = [name for name in LIBRARY if effect_class(name, True) != gone]
            flagged.append(diagnose(None, records, one["baselines"], library=library).verdict in FLAGS)
    return {"class withheld: flagged, pressures": share(flagged)}


def _naive(data: dict[str, Any]) -> dict[str, Any]:
    """Exact names on single effects by answers that need no diagnosis."""
    from rig.blind_check.naive import naive_answers

    right: dict[str, list[bool]] = {}
    for one in data.values():
        for records, names in one["cases"].values():
            for method, answer in naive_answers(
                records, one["baselines"], f"{len(right):x}{len(names):x}5", True
            ).items():
                right.setdefault(method, []).append(answer == (names[0] if names else "none") and len(names) < 2)
    return {f"exact name by {method.replace('_', ' ')}": share(outcomes) for method, outcomes in right.items()}


def _times(data: dict[str, Any]) -> dict[str, Any]:
    """Seconds a case, and how they grow: records, their length, effects of the library."""
    from rig.gap import diagnose
    from rig.gap.hypotheses.library import LIBRARY

    one = data["unit_a"]
    records, _ = one["cases"]["unit_a/case_02"]
    half = [record.rows(slice(0, len(record) // 2)) for record in records]

    def seconds(chosen: "Sequence[Record]", library: list[str] | None = None) -> float:
        diagnose(None, chosen, one["baselines"], library=library)
        start = time.perf_counter()
        diagnose(None, chosen, one["baselines"], library=library)
        return time.perf_counter() - start

    whole, first = seconds(records), "7 records of 20 s, whole library"
    return {
        "time a case: 7 records of 20 s, whole library": figure(whole, "s", why=_ALONE),
        "time a case: 3 records of 20 s": figure(seconds(records[:3]), "s", first, whole),
        "time a case: 7 records of 10 s": figure(seconds(half), "s", first, whole),
        "time a case: half of the library": figure(seconds(records, list(LIBRARY)[::2]), "s", first, whole),
        "time a case: 14 records of 20 s": figure(_doubled(one, records), "s", first, whole),
    }


def _doubled(one: dict[str, Any], records: "Sequence[Record]") -> float:
    """Seconds for twice the records (each once more under another name)."""
    from rig.gap import diagnose

    def twice(session: "Sequence[Record]") -> "list[Record]":
        return [*session, *(replace(record, name=f"again_{record.name}") for record in session)]

    start = time.perf_counter()
    diagnose(None, twice(records), [twice(session) for session in one["baselines"]])
    return time.perf_counter() - start
