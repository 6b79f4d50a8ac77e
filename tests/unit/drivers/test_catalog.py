"""The catalogue of drivers, mixed rigs, and the emulators' catalogue: names, lazy imports, and what is refused."""

import dataclasses
import subprocess
import sys

import pytest

from drivers.catalog import KINDS, entry
from drivers.mixed import MixedRig
from hil.emulators.catalog import EMULATORS
from rig.errors import ConfigError, DeviceError, DeviceLost
from rig.interfaces import Measurement, Role
from rig.realtime.clock import VirtualClock
from rig.sample import Flag

PERIOD_NS = 5_000_000
MONITORS = int(Flag.P1_ABSENT | Flag.P2_ABSENT)


@pytest.mark.parametrize("kind", list(KINDS))
def test_every_kind_has_settings_and_says_what_it_is(kind: str) -> None:
    found = entry(kind)
    assert dataclasses.is_dataclass(found.driver.Settings)
    assert found.summary


def test_every_driver_has_an_emulator() -> None:
    assert set(EMULATORS) == set(KINDS)


def test_an_unknown_kind_is_named_with_the_nearest() -> None:
    with pytest.raises(ConfigError, match=r"rig.yaml: unknown kind of device 'myroi'; did you mean 'myrio'\?"):
        entry("myroi", "rig.yaml")


def test_a_kind_that_is_nothing_like_a_known_one_is_told_where_ones_own_would_be() -> None:
    """Two places refused an unknown kind, and the other one alone said this."""
    with pytest.raises(ConfigError, match=r"allowed: itv_serial, .*, stand_in; a device of your own is an entry point"):
        entry("xyzzy", others=["stand_in"])


def test_a_missing_package_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in list(sys.modules):
        if name.startswith(("drivers.myrio", "nifpga")):
            monkeypatch.delitem(sys.modules, name)

    class NotThere:
        @staticmethod
        def find_spec(name: str, path: object = None, target: object = None) -> None:
            if name == "nifpga":
                raise ModuleNotFoundError("No module named 'nifpga'", name="nifpga")

    monkeypatch.setattr(sys, "meta_path", [NotThere, *sys.meta_path])
    with pytest.raises(ConfigError, match="'myrio' needs the Python package 'nifpga', which is not installed"):
        entry("myrio")


def test_the_catalogue_imports_no_vendor_before_it_is_asked() -> None:
    code = (
        "import sys, drivers.catalog; print([m for m in ('nifpga', 'serial', 'pymodbus', 'numpy') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


class Part:
    """A device that notes what it is asked, and can be told to fail or to take its time."""

    def __init__(self, clock: VirtualClock, *roles: Role, now: Measurement | None = None) -> None:
        self.roles = frozenset(roles)
        self.clock, self.now, self.asked = clock, now or Measurement(), []
        self.error: DeviceError | None = None
        self.takes_ns = 0

    def _do(self, what: str) -> None:
        self.asked.append(what)
        self.clock.wait_until_ns(self.clock.now_ns() + self.takes_ns)
        if self.error:
            raise self.error

    def open(self) -> dict[str, str]:
        self._do("open")
        return {"device": "part"}

    def read(self) -> Measurement:
        self._do("read")
        return self.now

    def write(self, p1_cmd_mpa: float, p2_cmd_mpa: float) -> None:
        self._do("write")

    def safe(self) -> None:
        self._do("safe")

    def prepare_safe(self) -> None:
        self._do("prepare_safe")

    def close(self) -> None:
        self.asked.append("close")


@pytest.fixture
def clock() -> VirtualClock:
    return VirtualClock()


@pytest.fixture
def parts(clock: VirtualClock) -> list[Part]:
    pressure = Measurement(0.3, p1_raw=3.4, flags=int(Flag.P2_ABSENT | Flag.ANGLE_ABSENT))
    valves = Part(clock, Role.VALVE_1, Role.VALVE_2, Role.MONITOR_1, now=pressure)
    sensor = Part(
        clock, Role.ANGLE, now=Measurement(angle_deg=12.0, angle_age_ns=7, flags=MONITORS | int(Flag.SUSPECT))
    )
    return [valves, sensor]


def test_one_role_on_two_devices_is_refused(clock: VirtualClock) -> None:
    with pytest.raises(ConfigError, match="roles: angle is filled by two devices"):
        MixedRig([Part(clock, Role.ANGLE), Part(clock, Role.ANGLE)], clock)


def test_values_flags_and_ages_are_put_together(clock: VirtualClock, parts: list[Part]) -> None:
    parts[1].takes_ns = 1_000_000
    now = MixedRig(parts, clock, PERIOD_NS).read()
    assert (now.p1_mpa, now.p1_raw, now.angle_deg) == (0.3, 3.4, 12.0)
    assert now.flags == Flag.P2_ABSENT | Flag.SUSPECT
    assert now.p1_age_ns == 1_000_000, "the first part's value grew older while the second was asked"
    assert now.angle_age_ns == 7
    assert now.p2_age_ns == 0


def test_set_points_and_safe_go_to_devices_with_valves_only(clock: VirtualClock, parts: list[Part]) -> None:
    mixed = MixedRig(parts, clock, PERIOD_NS)
    mixed.write(0.2, 0.2)
    mixed.safe()
    mixed.prepare_safe()
    assert parts[0].asked == ["write", "safe", "prepare_safe"]
    assert parts[1].asked == []


def test_safe_reaches_the_others_when_one_is_lost(clock: VirtualClock) -> None:
    first, second = Part(clock, Role.VALVE_1), Part(clock, Role.VALVE_2)
    first.error = DeviceLost("first: gone")
    with pytest.raises(DeviceLost, match="first: gone"):
        MixedRig([first, second], clock).safe()
    assert second.asked == ["safe"]


def test_the_worst_error_is_raised_with_all_of_them_named(clock: VirtualClock) -> None:
    first, second = Part(clock, Role.VALVE_1, Role.ANGLE), Part(clock, Role.VALVE_2, Role.MONITOR_2)
    first.error, second.error = DeviceError("first: late"), DeviceLost("second: gone")
    for call in (MixedRig([first, second], clock).read, MixedRig([first, second], clock).safe):
        with pytest.raises(DeviceLost, match="first: late; second: gone"):
            call()
    second.error = None
    with pytest.raises(DeviceError) as caught:
        MixedRig([first, second], clock).read()
    assert not isinstance(caught.value, DeviceLost)


def test_when_one_does_not_open_none_stays_open(clock: VirtualClock, parts: list[Part]) -> None:
    parts[1].error = DeviceLost("no answer")
    with pytest.raises(DeviceLost, match="no answer"):
        MixedRig(parts, clock).open()
    assert parts[0].asked == ["open", "close"]


def test_together_they_must_keep_the_period(clock: VirtualClock, parts: list[Part]) -> None:
    for part in parts:
        part.takes_ns = 3_000_000
    with pytest.raises(DeviceError, match=r"took 6.0 ms, longer than the period of 5 ms"):
        MixedRig(parts, clock, PERIOD_NS).read()
