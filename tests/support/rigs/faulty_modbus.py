"""A Modbus module with its line, spoilt by a test and healed after it: what such tests ask of it."""

from collections.abc import Callable

from drivers.modbus_io.device import ModbusIo
from drivers.modbus_io.settings import ExchangeMode
from hil.emulators.emulation import Emulation
from rig.errors import DeviceError
from support.rigs import fieldbus_rigs as rigs

HEALTHY = {
    "silence": False, "exception": 0, "refuse_next": 0, "late_s": 0.0, "cut": 0, "garble": -1, "only_unit": -1,
}  # fmt: skip
WHOLE = {"cut": [], "swapped_valves": False, "not_a_number": False}


def heal(running: Emulation) -> None:
    running.plug("io")
    running.trouble("io", **HEALTHY)
    running.damage("io", **WHOLE)


def made(running: Emulation, **changes: object) -> ModbusIo:
    """Quick to lose patience: the faults are waited for."""
    mode = ExchangeMode.SEPARATE if isinstance(running.places["io"], int) else ExchangeMode.AUTO
    return rigs.modbus(running, mode, **{"patience_s": 0.05, **changes})


def told(running: Emulation) -> tuple[float, float]:
    first, second = running.state()["commands_mpa"]
    return round(first, 3), round(second, 3)


def error_of(call: Callable[[], object]) -> DeviceError:
    """What it says when it fails, within seconds."""
    found: list[DeviceError] = []

    def failed() -> bool:
        try:
            call()
        except DeviceError as error:
            found.append(error)
        return bool(found)

    assert rigs.soon(failed), "no error"
    assert "\n" not in str(found[0])
    return found[0]
