"""A device's abilities, whether it derives from them or only has them by name; what stands for those it lacks."""

import math
from collections.abc import Callable
from types import ModuleType

import pytest
from conftest import ROOT
from support.script import module_at
from support.scripted import ScriptedDevice

from drivers import catalog
from rig.app.compose import STAND_INS, device_class
from rig.interfaces import Abilities, Role, Wiring, abilities_of, wiring_of
from rig.realtime.clock import VirtualClock

ABILITIES = [name for name in vars(Abilities) if not name.startswith("_")]
WIRING = [name for name in vars(Wiring) if not name.startswith("_")]
KINDS = [*STAND_INS, *catalog.KINDS]


class FromOutside(ScriptedDevice):
    """A device that knows nothing of Abilities and has some of them by name."""

    second_path = False

    def __init__(self, keep: Callable[[], None]) -> None:
        super().__init__()
        self.keep = keep

    def holds_safe(self) -> bool:
        return True


class SettingsFromOutside:
    """Settings of the same kind."""

    wires = ("a port",)

    def range_mpa(self, role: Role) -> tuple[float, float]:
        return (0.0, 0.4) if role is Role.VALVE_1 else (0.0, 0.9)


def test_what_a_device_from_outside_has_by_name_is_its_own() -> None:
    fed: list[str] = []
    found = abilities_of(FromOutside(lambda: fed.append("fed")))
    found.keep()
    assert (found.holds_safe(), found.second_path, fed) == (True, False, ["fed"])
    assert not abilities_of(FromOutside).second_path, "asked of the class, before one is made"


def test_what_a_device_from_outside_lacks_is_as_written() -> None:
    found = abilities_of(ScriptedDevice())
    found.keep(), found.prepare_safe(), found.shut_down()
    assert (found.holds_safe(), found.second_path, found.further) == (None, True, ())
    assert found.twin(VirtualClock()) is None


def test_what_settings_from_outside_tell() -> None:
    told, silent = wiring_of(SettingsFromOutside()), wiring_of(object())
    assert (told.wires, told.range_mpa(Role.VALVE_1), told.wired_to(Role.ANGLE)) == (("a port",), (0.0, 0.4), ())
    assert (silent.wires, silent.range_mpa(Role.VALVE_2)) == ((), (-math.inf, math.inf))
    assert (dict(silent.read_now()), dict(silent.further)) == ({}, {})


def test_the_example_of_a_package_from_outside_derives_from_nothing_and_has_its_abilities() -> None:
    rig = example("spring_rig").SpringRig
    assert not issubclass(rig, Abilities)
    assert abilities_of(rig).second_path


@pytest.mark.parametrize("kind", KINDS)
def test_our_own_devices_derive_from_them(kind: str) -> None:
    made = device_class(kind, "a test")
    assert issubclass(made, Abilities)
    assert issubclass(made.Settings, Wiring)


@pytest.mark.parametrize("name", [*ABILITIES, *WIRING])
def test_each_stands_in_the_table(name: str) -> None:
    page = (ROOT / "docs" / "how-to" / "add_a_device.md").read_text(encoding="utf-8")
    assert f"| `{name}" in page


def example(name: str) -> ModuleType:
    place = ROOT / "docs" / "examples" / "pamrig_example" / "pamrig_example" / f"{name}.py"
    return module_at(place)
