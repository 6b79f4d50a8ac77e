"""The practice set beside the checkout: names that must be right, on both units. Skips where the set is absent."""

import json
from pathlib import Path

import pytest
from conftest import ROOT

from rig.gap import diagnose
from rig.log.reader import read
from rig.model.parameters import load_model

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


def test_the_tutorial_tells_what_comes_out(shared: Path) -> None:
    practice, page = shared / "practice", (ROOT / "docs/tutorial/diagnose_practice.md").read_text(encoding="utf-8")
    baselines = [read(practice / "unit_b" / f"baseline_{k}") for k in (1, 2, 3, 4)]
    found = diagnose(load_model(ROOT / "configs/models/simulated.yaml"), read(practice / "unit_b/case_04"), baselines)
    size = {cause.effect: next(iter(cause.parameters.values())).value for cause in found.causes}
    chance = {(line.effect, line.side): f"{line.probability:.2f}" for line in found.ranking}
    for said in (
        f"{100 * found.where.shares['valve']:.0f} % of the angle gap",
        f"a delay of {1e3 * size['delay']:.0f} ms and a backlash of +-{size['backlash']:.2f} degrees",
        f"it is {100 * found.confidence:.0f} % sure of both names",
        f"from {found.gap.rms_deg:.1f} to {found.gap.after_deg:.1f} degrees",
        f"{chance['valve_lag', 'pressures']} against {chance['delay', 'pressures']}",
        f"has {chance['coulomb_friction', 'angle']}:",
        f"misses the earlier days by {found.evidence.model_misfit_deg:.1f} degrees",
    ):
        assert said in page


def test_without_pressures_the_practice_delay_is_still_named(shared: Path) -> None:
    practice = shared / "practice"
    baselines = [read(practice / "unit_a" / f"baseline_{k}") for k in (1, 2)]
    found = diagnose(None, read(practice / "unit_a" / "case_03"), baselines, pressures=False)
    assert found.causes[0].effect == "delay"
