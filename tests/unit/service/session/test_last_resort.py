"""What would be left without pamrig: said at arming, and refused when it takes too long."""

from dataclasses import replace

import pytest

from rig.app import compose
from rig.app.supervised_command import check_last_resort
from rig.errors import RigError
from rig.rig_config import RigConfig
from rig.service.session.last_resort import last_resort


@pytest.fixture
def rig() -> RigConfig:
    simulated = compose.load(None)
    return replace(simulated, devices=tuple(replace(entry, kind="modbus_io") for entry in simulated.devices))


@pytest.mark.parametrize("takes_s", ["0.5", "1"])
def test_a_watchdog_within_the_bound_is_nothing_to_speak_of(rig: RigConfig, takes_s: str) -> None:
    left = last_resort(rig, {"watchdog_s": takes_s})
    assert (left.problems, left.lines) == ((), ())


def test_a_watchdog_that_takes_longer_is_refused_unless_forced(
    rig: RigConfig, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(
        RigError, match=r"its watchdog takes 1.1 s, longer than the rig's safe.watchdog_s, 1 s: .*or give --force"
    ):
        check_last_resort(rig, {"watchdog_s": "1.1"}, force=False)
    check_last_resort(rig, {"watchdog_s": "1.1"}, force=True)
    assert "its watchdog takes 1.1 s" in capsys.readouterr().err.replace("\n", " ")


def test_the_bound_is_the_rig_s(rig: RigConfig) -> None:
    patient = replace(rig, safe=replace(rig.safe, watchdog_s=5.0))
    assert not last_resort(patient, {"watchdog_s": "5"}).problems
    assert last_resort(patient, {"watchdog_s": "5.1"}).problems


@pytest.mark.parametrize(
    ("facts", "says"), [({}, "no watchdog of its own"), ({"watchdog_s": "unknown"}, "time is not known")]
)
def test_without_a_watchdog_the_operator_is_told_what_would_stay(
    rig: RigConfig, facts: dict[str, str], says: str
) -> None:
    (line,) = last_resort(rig, facts).lines
    assert says in line
    assert "the valves keep their last set-points, up to 0.5 MPa each" in line


def test_of_several_devices_those_with_valves_count(rig: RigConfig) -> None:
    (whole,) = rig.devices
    valves = replace(whole, name="valves", roles=frozenset(role for role in whole.roles if "valve" in role))
    sensors = replace(whole, name="sensors", roles=whole.roles - valves.roles)
    mixed = replace(rig, devices=(sensors, valves))
    assert not last_resort(mixed, {"2.watchdog_s": "0.5"}).lines
    assert last_resort(mixed, {"1.watchdog_s": "0.5"}).lines[0].startswith("valves: no watchdog")
