"""`pamrig gap study intervals`: what is read of a check's cases, and what is not."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rig.app.gap.study.fitted_checks import checks_of
from rig.app.gap.study.intervals import LEAST_CASES, with_intervals
from rig.blind_check.folder import CheckFolder, write_json, write_truth
from rig.blind_check.row import CaseKind, Row, Scored
from rig.errors import RecordError
from rig.gap.priors import fitted

MODE, SIZE_S = "one_day", 0.03
CLEAR = Row(
    CaseKind.SINGLE, ("delay",), 5.0, MODE, family="mckibben", named=("delay",), ef_interval=(0.8, 1.0), realised_ef=0.9
)
FACTS = {
    "effects": {"delay": {"stage": "valve", "library_parameter": "delay_s", "size": SIZE_S}},
    "ratio_angle": 5.0,
}  # fmt: skip


def said(off_s: float) -> dict[str, Any]:
    """A diagnosis that names a delay by so much too long."""
    number = {"value": SIZE_S + off_s, "low": SIZE_S + off_s - 0.002, "high": SIZE_S + off_s + 0.002}
    added = {"effect": "delay", "parameters": {"delay_s": SIZE_S + off_s}}
    cause = {"effect": "delay", "judged_on": "pressures", "parameters": {"delay_s": number}, "added_to_model": added}
    gap = {"rms_deg": 2.0, "floor_deg": 0.2}
    evidence = {"records": [{"gap_after_deg": 0.3}, {"gap_after_deg": 0.4}]}
    return {"diagnosis": {"reference": "session", "causes": [cause], "gap": gap, "evidence": evidence}}


def put(folder: CheckFolder, token: str, answer: dict[str, Any], row: Row = CLEAR) -> None:
    """One scored case of a check."""
    write_json(folder.answer(token), {"modes": {MODE: answer}})
    write_json(folder.score(token), Scored({MODE: row}, {}, []).to_json())
    write_truth(folder.truth(token), FACTS, {}, [])


@pytest.fixture
def checked(tmp_path: Path) -> CheckFolder:
    """As many cases as are needed."""
    folder, random = CheckFolder(tmp_path), np.random.default_rng(1)
    for number in range(LEAST_CASES):
        put(folder, f"case_{number:02d}", said(0.002 * random.standard_normal()))
    return folder


def counted(folder: CheckFolder, *left_out: str) -> tuple[int, int]:
    """How many cases what is left of a gap, and sizes beside a description, were fitted on."""
    found = with_intervals(fitted(), [folder], left_out)
    return found.prediction.cases, found.reaches["described"].cases


def test_every_clear_case_counts(checked: CheckFolder) -> None:
    assert counted(checked) == (LEAST_CASES, LEAST_CASES)


def test_where_they_come_from_is_said_of_intervals_alone(checked: CheckFolder) -> None:
    shipped = fitted()
    found = with_intervals(shipped, [checked], ["fluidic"])
    made = found.provenance.parts["prediction"]
    assert made.command == f"pamrig gap study intervals {checked.root.name} --leave-out fluidic"
    assert found.provenance == shipped.provenance.renewed({"prediction": made, "reaches.described": made})


def test_a_case_that_was_refused_counts_nothing_and_ends_nothing(checked: CheckFolder) -> None:
    put(checked, "refused", {"error": "RecordError: no excitation"}, Row(CaseKind.SINGLE, ("delay",), 5.0, MODE))
    put(checked, "refused_later", {"error": "LookupError: gone"})
    assert counted(checked) == (LEAST_CASES, LEAST_CASES)


@pytest.mark.parametrize(
    "row",
    [
        Row(CaseKind.FOREIGN, ("knock",), 5.0, MODE, ef_interval=(0.8, 1.0), realised_ef=0.9),
        Row(CaseKind.SINGLE, ("delay",), 1.0, MODE, ef_interval=(0.8, 1.0), realised_ef=0.9),
        Row(CaseKind.SINGLE, ("delay",), 5.0, MODE, family="fluidic", ef_interval=(0.8, 1.0), realised_ef=0.9),
    ],
    ids=["of no law", "not clear", "of a family left out"],
)
def test_what_tells_nothing_of_the_library_s_effects_is_left_out(checked: CheckFolder, row: Row) -> None:
    put(checked, "other", said(0.5), row)
    assert counted(checked, "fluidic") == (LEAST_CASES, LEAST_CASES)


def test_too_few_cases_are_refused(checked: CheckFolder) -> None:
    checked.score("case_00").unlink()
    with pytest.raises(RecordError, match=r"19 cases name an effect .* at least 20"):
        with_intervals(fitted(), [checked], ())


@pytest.mark.parametrize("answer", [None, [], {}, {"modes": None}, {"modes": {}}, {"modes": {MODE: 1}}])
def test_an_answer_that_is_none_is_named(checked: CheckFolder, answer: object) -> None:
    write_json(checked.answer("case_03"), answer)
    with pytest.raises(RecordError, match=rf"case_03.json: is not what a blind check writes: .*{MODE}"):
        counted(checked)


def test_only_folders_of_scored_checks_are_fitted_to_and_each_once(checked: CheckFolder) -> None:
    assert checks_of([checked.root]) == [checked]
    for other in (checked.answers, checked.root / "none"):
        with pytest.raises(RecordError, match=rf"{other}: no scored check is there"):
            checks_of([checked.root, other])
    with pytest.raises(RecordError, match="a check is there twice"):
        checks_of([checked.root, checked.root / ".." / checked.root.name])
