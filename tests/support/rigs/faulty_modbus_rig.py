"""A Modbus module to be spoilt, as fixtures: `running` over TCP and over a serial line, `tcp` over TCP alone."""

from collections.abc import Iterator

import pytest

from hil.emulators.emulation import Emulation
from support.rigs import fieldbus_rigs as rigs
from support.rigs.faulty_modbus import heal


@pytest.fixture(params=["tcp", "rtu"])
def running(request: pytest.FixtureRequest) -> Iterator[Emulation]:
    running = rigs.wago(f"faulty_{request.param}", rigs.BAUD if request.param == "rtu" else None)
    yield running
    heal(running)


@pytest.fixture
def tcp() -> Iterator[Emulation]:
    running = rigs.wago("faulty_tcp")
    yield running
    heal(running)
