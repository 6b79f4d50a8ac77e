"""The practice set beside the checkout: names that must be right, on both units. Skips where the set is absent."""

import json
from pathlib import Path

import pytest

from rig.gap import diagnose
from rig.gap.hypotheses.library import LIBRARY
from rig.log.reader import read

CASES = (
    "unit_a/case_01", "unit_a/case_02", "unit_a/case_06", "unit_a/case_08", "unit_a/case_11", "unit_a/case_13",
    "unit_b/case_01", "unit_b/case_04", "unit_b/case_06", "unit_b/case_08", "unit_b/case_14",
)  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_practice_case(shared: Path, case: str) -> None:
    practice = shared / "practice"
    wanted = {one["effect"] for one in json.loads((practice / "labels.json").read_text())[case]} - {"none"}
    baselines = [read(practice / case.split("/")[0] / f"baseline_{k}") for k in (1, 2, 3, 4)]
    found = diagnose(None, read(practice / case), baselines)
    assert {cause.effect for cause in found.causes} == wanted
    assert found.verdict == ("explained" if wanted else "none")


def test_without_pressures_the_practice_delay_is_still_named(shared: Path) -> None:
    practice = shared / "practice"
    baselines = [read(practice / "unit_a" / f"baseline_{k}") for k in (1, 2)]
    found = diagnose(None, read(practice / "unit_a" / "case_03"), baselines, pressures=False)
    assert found.causes[0].effect == "delay"


def test_beside_days_a_name_that_leaves_many_floors_is_not_all_there_is(shared: Path) -> None:
    """Both valves are slower than they may slew; without that effect a limit of filling alone is the likeliest, and
    leaves 2.5 deg where days differ by 0.13."""
    practice = shared / "practice"
    baselines = [read(practice / "unit_a" / f"baseline_{k}") for k in (1, 2, 3, 4)]
    library = [name for name in LIBRARY if name != "valve_slew"]
    found = diagnose(None, read(practice / "unit_a" / "case_10"), baselines, library=library)
    assert found.verdict == "partly_explained"
    assert [cause.judged_on for cause in found.causes if not cause.is_named] == ["pressures"]
