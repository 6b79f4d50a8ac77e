"""The simulated rig recorded by pamrig's own loop, which takes each record's zero at rest and never stops between
records: what it lacks is named, once, and a healthy one lacks nothing."""

from pathlib import Path

import pytest
import yaml
from conftest import CONFIGS
from support.warm import Warm

from rig.gap import diagnose
from rig.gap.answer.result import Diagnosis
from rig.log.reader import read
from rig.model.parameters import load_model
from rig.record import Record

MODEL = load_model(CONFIGS / "models" / "simulated.yaml")


class Recorder:
    """Sessions of the usual sweep, each recorded once."""

    def __init__(self, warm: Warm, place: Path) -> None:
        self._warm, self._place = warm, place

    def session(self, seed: int, effect: str = "", **numbers: float) -> list[Record]:
        """Of the shipped simulated rig on the day of that seed, with an effect that it is to have."""
        folder = self._place / f"{effect or 'healthy'}_{seed}"
        if not folder.exists():
            rig = yaml.safe_load((CONFIGS / "rigs" / "simulated.yaml").read_text(encoding="utf-8"))
            rig["devices"]["main"] |= {"model": "simulated"}
            rig["devices"]["main"] |= {"effects": [{"effect": effect, "parameters": numbers}]} if effect else {}
            own = self._place / f"{folder.name}.yaml"
            own.write_text(yaml.safe_dump(rig), encoding="utf-8")
            command = ["pamrig", "run", "gap", "--rig", str(own), "--clock", "virtual", "--seed", str(seed)]
            status, written = self._warm.run([*command, "-o", str(folder)], self._place)
            assert status == 0, written
        return read(folder)


@pytest.fixture(scope="module")
def recorder(warm: Warm, tmp_path_factory: pytest.TempPathFactory) -> Recorder:
    return Recorder(warm, tmp_path_factory.mktemp("by_the_loop"))


def named(found: Diagnosis) -> list[str]:
    return [cause.effect for cause in found.causes]


@pytest.mark.parametrize("seed", [103, 108])
def test_a_healthy_session_lacks_nothing_beside_another(recorder: Recorder, seed: int) -> None:
    """Seven of ten had a cause while two sessions lay 0.6 % apart in their gains."""
    assert not named(diagnose(MODEL, recorder.session(seed), [recorder.session(101)]))


def test_where_a_hold_leaves_the_joint_at_rest_is_no_second_cause(recorder: Recorder) -> None:
    """It was "the sensor's zero is 5.3 deg higher", at 0.95."""
    held = recorder.session(30, "valve_dead_band", width_mpa=0.015)
    assert named(diagnose(MODEL, held, [recorder.session(101)])) == ["valve_dead_band"]


def test_a_rig_that_warms_through_the_session_does_so_by_its_simulator_alone(recorder: Recorder) -> None:
    """It was creep over 40 s, or four others."""
    found = diagnose(MODEL, recorder.session(4, "thermal_drift", rate_per_min=0.05))
    assert named(found) == ["thermal_drift"]
    numbers = found.causes[0].parameters
    assert numbers["whole_session"].value == 1.0
    assert numbers["rate_per_min"].value == pytest.approx(0.05, rel=0.1)


@pytest.mark.parametrize(
    ("effect", "number", "size"), [("lost_samples", "probability", 0.05), ("quantisation", "step_deg", 0.5)]
)
def test_what_is_in_the_samples_is_found_with_its_size(
    recorder: Recorder, effect: str, number: str, size: float
) -> None:
    found = diagnose(MODEL, recorder.session(21, effect, **{number: size}))
    assert named(found) == [effect]
    assert found.causes[0].parameters[number].value == pytest.approx(size, rel=0.1)
