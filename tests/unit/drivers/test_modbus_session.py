"""What the edge to pymodbus says when a module refuses: where, what was asked of which register, and why."""

from types import SimpleNamespace

import pytest

from drivers.modbus_io.session import Session
from rig.errors import DeviceError


def test_a_refused_register_is_named_in_both_ways_that_manuals_write_it() -> None:
    refusal = SimpleNamespace(isError=lambda: True, exception_code=2)
    client = SimpleNamespace(connected=True, read_holding_registers=lambda *_, **__: refusal)
    with pytest.raises(DeviceError) as error:
        Session(client, "wago:502").read(3, 8210, 1, 1)
    said = (
        "wago:502: reading 1 registers at address 8210 (0x2012): exception 2: it has no such register: wrong "
        "map, or wrong module"
    )
    assert str(error.value) == said
