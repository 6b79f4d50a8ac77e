"""An emulated myRIO in real time for the tests of `pamrig devices`: fixtures `lab`, and `hurried` for its ticker."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from drivers.myrio.device import MyRio
from drivers.myrio.settings import MyRioSettings
from hil.emulators.nifpga.bitfile import personality
from hil.emulators.nifpga.board import BoardWiring
from hil.emulators.nifpga.stand_in import StandIn
from hil.emulators.world import World
from rig.app.devices import bringup
from rig.interfaces import DeviceContext, Role
from rig.realtime.clock import MonotonicClock
from support.rigs.devices_command import SAFE, Lab
from support.rigs.factories import Lag


@pytest.fixture
def lab(tmp_path: Path) -> Iterator[Lab]:
    clock = MonotonicClock()
    stand_in = StandIn(World(Lag(), clock, commands=SAFE), tmp_path, "RIO0", BoardWiring(), personality())
    settings = MyRioSettings(Path(stand_in.settings["bitfile"]))
    # a period no pause of a busy test machine can exceed
    yield Lab(stand_in, MyRio(settings, DeviceContext(clock, frozenset(Role), *SAFE, period_ns=1_000_000_000)))
    stand_in.close()


@pytest.fixture
def hurried(monkeypatch: pytest.MonkeyPatch) -> None:
    """The ticker lives in real time; these rigs need none of its caution."""
    monkeypatch.setattr(bringup, "SLEW_MPA_S", 5.0)
    monkeypatch.setattr(bringup, "AVERAGED_S", 0.05)
