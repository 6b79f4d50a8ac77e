"""The check as a whole: its pieces of work, and the result from everybody's scores.

One piece is one unit with its cases. Each step skips what is already on disk, so that a killed check goes on where it
was.
"""

import hashlib
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from rig.blind_check.answer import answer_cases
from rig.blind_check.experiments import figures_by_experiments
from rig.blind_check.folder import MODEL_FILES, CheckFolder, read_json, read_truth, require_answers, write_json
from rig.blind_check.follow_up import carry_out, rounds_of
from rig.blind_check.generate import BenchCases, make_unit, open_labels
from rig.blind_check.modes import MODES, MOST_FOLLOW_UPS
from rig.blind_check.row import Row, Scored, facts_of, read_scored, truth_of
from rig.blind_check.sandbox import LAYERS
from rig.blind_check.score import realised, score_mode
from rig.blind_check.source import Label
from rig.blind_check.statistics import breakdown, mode_result, naive_result, shuffled_control, withheld_result
from rig.errors import RecordError
from rig.gap.hypotheses.library import LIBRARY, effect_class
from rig.gap.priors import Fitted, fitted

CHUNK: Final = 10
"""Questions an answering process is started for when the steps are done apart."""


def make_answer_score(unit: BenchCases, keep: bool = False, rounds: int = MOST_FOLLOW_UPS) -> int:
    """All three steps for one unit; returns how many cases it has. Records are removed when scored unless `keep`."""
    make_unit(unit)
    answer_cases(str(unit.folder.questions), str(unit.folder.answers), unit.tokens)
    score_unit(unit, rounds)
    if not keep:
        for folder in (unit.folder, *(unit.folder.follow_up(number) for number in range(1, rounds + 1))):
            for token in unit.tokens:
                shutil.rmtree(folder.question(token), ignore_errors=True)
        shutil.rmtree(unit.folder.maker / "benches" / unit.source.bench_key(unit.labels[0]), ignore_errors=True)
    return len(unit.tokens)


def answer_chunk(folder: CheckFolder, tokens: Sequence[str]) -> int:
    """Answer some questions in a process of their own; returns how many there are."""
    answer_cases(str(folder.questions), str(folder.answers), tokens)
    return len(tokens)


def score_unit(unit: BenchCases, rounds: int = MOST_FOLLOW_UPS) -> int:
    """Recommended experiments, at most so many `rounds`, and scores of a unit's cases; returns how many. RecordError
    where one is not answered."""
    labels = dict(zip(unit.tokens, unit.labels, strict=True))
    missing = {token: label for token, label in labels.items() if not unit.folder.score(token).exists()}
    require_answers(unit.folder, missing)
    carry_out(unit.source, unit.folder, missing, rounds)
    for token, label in missing.items():
        write_json(unit.folder.score(token), score_case(unit.folder, token, label).to_json())
    return len(labels)


def score_case(folder: CheckFolder, token: str, label: Label) -> Scored:
    """Everything about one case: a row for each mode with what further experiments made of it, and naive answers."""
    from rig.model.parameters import load_model

    answer = read_json(folder.answer(token))
    case_facts, untouched, healthy = read_truth(folder.truth(token))
    truth, facts = truth_of(label), facts_of(case_facts)
    rows, later = {}, rounds_of(folder, token, truth, facts)
    for mode, reply in answer["modes"].items():
        model = load_model(folder.question(token) / MODEL_FILES[MODES[mode].model])
        rows[mode] = replace(
            score_mode(mode, reply, truth, facts),
            realised_ef=realised(model, reply, truth, untouched, healthy),
            truth_withheld=bool(set(truth.effects) & set(answer["leave_out"])),
            rounds=tuple(later.get(mode, ())),
        )
    return Scored(rows, answer["naive"], answer["sandbox_layers"], case_facts, token)


def result_of(folder: CheckFolder) -> dict[str, Any]:
    """The result of a check from its scores; RecordError when cases are missing."""
    part, cases = _scored(folder)
    public = {"sealed_sha256": part["sealed_sha256"], "seed": part["seed"]}
    return public | result_from(cases, part["seed"], part["fitted_on"])


def result_of_all(folders: Sequence[CheckFolder], unfinished: bool = False) -> dict[str, Any]:
    """One result of several checks, with the seed and the hash of each; RecordError when a check is named twice.

    `unfinished`: with what is scored so far of checks that were stopped.
    """
    parts = [_scored(folder, unfinished) for folder in folders]
    hashes = [part["sealed_sha256"] for part, _ in parts]
    if len(set(hashes)) < len(hashes):
        raise RecordError(f"{folders[0].root}: the same labels are there twice; name each check once")
    together = hashlib.sha256("".join(sorted(hashes)).encode()).hexdigest()
    cases = [case for _, some in parts for case in some]
    fitted_on = {name for part, some in parts for name in part["fitted_on"] if name in _judged(some)}
    public = {"sealed_sha256": together, "parts": [part for part, _ in parts]}
    return public | result_from(cases, parts[0][0]["seed"], sorted(fitted_on))


def _judged(cases: Sequence[Scored]) -> set[str]:
    """The families of these cases."""
    return {row.family for case in cases for row in case.rows.values()}


def _scored(folder: CheckFolder, unfinished: bool = False) -> tuple[dict[str, Any], list[Scored]]:
    """(what is public of a check and its seed, its scores by token)."""
    labels, seed = open_labels(folder)
    missing = [token for token in labels if not folder.score(token).exists()]
    if len(missing) == len(labels) or (missing and not unfinished):
        raise RecordError(
            f"{folder.root}: {len(missing)} of {len(labels)} cases are not scored, the first is {missing[0]}; run "
            "the steps again"
        )
    scored = [token for token in sorted(labels) if token not in missing]
    sha256 = read_json(folder.sealed)["sealed_sha256"]
    public = {"sealed_sha256": sha256, "seed": seed, "cases": len(labels), "scored": len(scored)}
    return public | {"fitted_on": families_of_levels(folder)}, [read_scored(folder.score(token)) for token in scored]


def families_of_levels(folder: CheckFolder) -> list[str]:
    """The plant families on which the levels were fitted by which the check is answered."""
    return list(levels_of(folder).provenance.families)


def levels_of(folder: CheckFolder) -> Fitted:
    """The levels and priors by which the check is answered."""
    return fitted(folder.priors) if folder.priors.exists() else fitted()


def result_from(cases: Sequence[Scored], seed: int, fitted_on: Sequence[str]) -> dict[str, Any]:
    """The figures of scored cases, mode by mode; `fitted_on`: families that were judged by levels fitted on them."""
    kinds = [next(iter(case.rows.values())).kind.value for case in cases]
    rows = {mode: [case.rows[mode] for case in cases if mode in case.rows] for mode in MODES}
    asked = [mode for mode in MODES if rows[mode] and not MODES[mode].withheld]
    modes = {mode: mode_result(rows[mode]) | breakdown(rows[mode]) for mode in asked}
    for mode in asked:
        modes[mode] |= figures_by_experiments(rows[mode])
    withheld = {mode: withheld_result(rows[mode]) for mode in MODES if MODES[mode].withheld and rows[mode]}
    for mode, found in withheld.items():
        if MODES[mode].withheld in modes:
            modes[MODES[mode].withheld]["withheld_flagged"] = found["flagged"]
    return {
        "cases": len(cases),
        "fitted_on": list(fitted_on),
        "kinds": {kind: kinds.count(kind) for kind in sorted(set(kinds))},
        **_sandbox(cases),
        "modes": modes,
        "families": {family: _apart(rows, asked, family) for family in _families(rows)},
        "withheld": withheld,
        "naive": {name: _naive(cases, name) for name in ("always_none", "random", "largest_rmse", "retuned")},
        "shuffled": shuffled_control(rows[asked[0]], seed),
    }


def _families(rows: Mapping[str, Sequence[Row]]) -> list[str]:
    return sorted({row.family for some in rows.values() for row in some if row.family})


def _apart(rows: Mapping[str, Sequence[Row]], asked: Sequence[str], family: str) -> dict[str, Any]:
    """Mode by mode the figures of one family's cases."""
    own = {mode: [row for row in rows[mode] if row.family == family] for mode in asked}
    return {mode: mode_result(some) for mode, some in own.items() if some}


def _sandbox(cases: Sequence[Scored]) -> dict[str, list[str]]:
    """The layers that stood around every single answer, and those that did not."""
    stood = set(LAYERS).intersection(*(case.sandbox_layers for case in cases))
    return {
        "sandbox_layers": [layer for layer in LAYERS if layer in stood],
        "sandbox_missing": [layer for layer in LAYERS if layer not in stood],
    }


def write_result(folder: CheckFolder, result: Mapping[str, Any]) -> Path:
    """Keep the result beside the scores; returns where."""
    path = folder.root / "result.json"
    write_json(path, result)
    return path


def _naive(cases: Sequence[Scored], name: str) -> dict[str, Any]:
    """A baseline's figures with and without pressures, on the cases of the first mode that has them or not; it answered
    every case."""

    asked = [mode for mode in MODES if any(mode in case.rows for case in cases)]

    def answered(pressures: bool) -> dict[str, Any]:
        mode = next((mode for mode in asked if MODES[mode].pressures is pressures), asked[0])
        column = "pressures" if pressures else "angle"
        named = [(case.rows[mode], case.naive[column][name]) for case in cases if mode in case.rows]
        return naive_result(named, lambda name, truth: _alike(name, truth, pressures))

    return {"pressures": answered(True), "angle": answered(False)}


def _alike(named: str, truth: str, pressures: bool) -> bool:
    return named in LIBRARY and truth in LIBRARY and effect_class(named, pressures) == effect_class(truth, pressures)
