"""The tutorial on a practice case: its numbers are what its own lines give."""

import re
from pathlib import Path

import pytest
from conftest import ROOT
from support.warm import Warm

from rig.gap import diagnose
from rig.log.reader import read
from rig.model.parameters import load_model

PAGE = (ROOT / "docs/tutorial/diagnose_practice.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def recorded(warm: Warm, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder in which the page's records were made."""
    place = tmp_path_factory.mktemp("practice")
    (rig,) = re.findall(r"```yaml file=bad_day.yaml\n(.*?)```", PAGE, re.DOTALL)
    (place / "bad_day.yaml").write_text(rig, encoding="utf-8")
    for line in re.findall(r"^pamrig (run .*)$", PAGE, re.MULTILINE):
        status, written = warm.run(["pamrig", *line.split()], place)
        assert status == 0, written
    return place


def test_the_tutorial_tells_what_comes_out(recorded: Path) -> None:
    baselines = [read(day) for day in sorted(recorded.glob("healthy/*"))]
    found = diagnose(load_model(ROOT / "configs/models/simulated.yaml"), read(recorded / "bad_day"), baselines)
    size = {cause.effect: next(iter(cause.parameters.values())).value for cause in found.causes}
    chance = {(line.effect, line.judged_on): f"{line.probability:.2f}" for line in found.ranking}
    for said in (
        f"{100 * found.where.shares['valve']:.0f} % of the angle gap",
        f"a delay of {1e3 * size['delay']:.0f} ms and a backlash of +-{size['backlash']:.2f} degrees",
        f"it is {100 * found.confidence:.0f} % sure of all that",
        f"from {found.gap.rms_deg:.1f} to {found.gap.after_deg:.2f} degrees, less than the floor of "
        f"{found.gap.floor_deg:.2f}",
        f"{chance['valve_lag', 'pressures']} against {chance['delay', 'pressures']}",
        f"has {chance['coulomb_friction', 'angle']}:",
    ):
        assert said in PAGE
