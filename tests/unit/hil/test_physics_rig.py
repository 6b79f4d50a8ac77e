"""The physics rig behind a device: tick by tick it is the rig of whole records, and says what it cannot have."""

import numpy as np
import pytest

from hil.physics import PhysicsRig, PhysicsSettings
from hil.reference import families
from hil.reference.names import STEPPED
from rig.errors import DeviceError, RigError
from rig.interfaces import DeviceContext, Role
from rig.realtime.clock import VirtualClock

PERIOD_S = 0.005
TICKS = 600
DP = 0.2 * np.sin(2 * np.pi * 0.5 * PERIOD_S * np.arange(TICKS))


@pytest.mark.parametrize("name", STEPPED)
@pytest.mark.parametrize("effects", [{}, {"delay": 0.03}, {"valve_lag": 0.03, "viscous_friction": 1.0}], ids=str)
def test_tick_by_tick_it_is_the_rig_of_whole_records(name: str, effects: dict[str, float]) -> None:
    unit = families.unit(name, 3)
    wrong = families.disturbance(name, effects)
    whole = unit.simulate(0.2 + DP / 2, 0.2 - DP / 2, PERIOD_S, unit.session(1, 0.004), wrong)
    stepped = families.stepped(name, 3, PERIOD_S, (1, 0.004), wrong)
    read = np.array([stepped.step(0.2 + dp / 2, 0.2 - dp / 2) for dp in DP])[:-1]
    loose = 0.5 if "delay" in effects else 0.15  # in records the delay wavers
    assert np.sqrt(np.mean((read[:, 2] - whole["angle_deg"][1:]) ** 2)) < loose
    assert np.sqrt(np.mean((read[:, 0] - whole["p1_mpa"][1:]) ** 2)) < 0.005


@pytest.mark.parametrize("name", STEPPED)
@pytest.mark.parametrize("effect", ["backlash", "sensor_lag", "lost_samples"])
def test_effects_that_need_the_whole_record_are_refused(name: str, effect: str) -> None:
    with pytest.raises(RigError, match="is for whole records"):
        families.stepped(name, 1, PERIOD_S, (1, 0.004), families.disturbance(name, {effect: 0.05}))


def test_a_family_without_steps_is_told() -> None:
    with pytest.raises(RigError, match="tick by tick there is mckibben, fluidic"):
        families.stepped("pleated", 1, PERIOD_S, (1, 0.004), families.disturbance("pleated", {}))


def device(clock: VirtualClock, **settings: object) -> PhysicsRig:
    return PhysicsRig(PhysicsSettings(**settings), DeviceContext(clock, frozenset(Role), 0.2, 0.2))  # type: ignore[arg-type]


def test_one_seed_is_one_history_and_another_day_another() -> None:
    histories = []
    for settings in ({"seed": 4}, {"seed": 4}, {"seed": 5}, {"seed": 4, "day": 2}):
        clock = VirtualClock()
        rig = device(clock, **settings)
        rig.open()
        shown = []
        for tick in range(50):
            shown.append(rig.read())
            rig.write(0.2 + 0.001 * tick, 0.2)
            clock.wait_until_ns(clock.now_ns() + 5_000_000)
        histories.append(shown)
    assert histories[0] == histories[1]
    assert histories[0] != histories[2]
    assert histories[0] != histories[3]


def test_it_is_a_device_like_any_other() -> None:
    clock = VirtualClock()
    rig = device(clock, family="fluidic")
    rig.open()
    with pytest.raises(DeviceError, match="not finite"):
        rig.write(float("nan"), 0.2)
    rig.write(0.9, -0.3)
    assert not rig.holds_safe()
    rig.safe()
    assert rig.holds_safe()
