"""The module's own watchdog, and whether it is the module that the map describes. Register writes from the map, nothing
more."""

from collections.abc import Mapping, Sequence

from drivers.modbus_io.codec import encode
from drivers.modbus_io.maps import Failsafe, Identity, ModuleMap, RegisterWrite, SafeIs
from drivers.modbus_io.session import ModbusSession
from rig.errors import DeviceLost


def identify(session: ModbusSession, module: ModuleMap, unit: int) -> str:
    """What the module says it is; DeviceLost when that is something else. Maps without an identity are believed."""
    wanted = module.identity
    if wanted is None:
        return f"{module.name} (cannot be told apart from others)"
    registers = session.read(wanted.function, wanted.address, wanted.count, unit)
    found = _text(registers) if wanted.text else ", ".join(map(str, registers))
    if not _fits(wanted, registers):
        raise DeviceLost(f"{session.where} unit {unit}: says {found!r}, but the map is for {module.name}")
    return f"{module.name} ({found})"


def _fits(wanted: Identity, registers: Sequence[int]) -> bool:
    return wanted.text in _text(registers) if wanted.text else list(registers) == wanted.registers


def _text(registers: Sequence[int]) -> str:
    data = b"".join(register.to_bytes(2, "big") for register in registers)
    return data.decode("ascii", "replace").strip("\0 ")


def arm(
    session: ModbusSession, module: ModuleMap, unit: int, watchdog_s: float, safe_numbers: Mapping[int, float]
) -> Mapping[str, str]:
    """Arm the watchdog where there is one; facts for the log, with a warning where there is none.

    `safe_numbers`: output channel -> counts of its safe set-point, of those that are ours.
    """
    failsafe = module.failsafe
    if failsafe is None:
        return {
            "failsafe": "none",
            "warning": f"{module.name} holds its outputs when the host is gone: {module.about_failsafe}",
        }
    ticks = max(1, round(watchdog_s / failsafe.tick_s))
    for step in failsafe.arm:
        if step.safe_channel is not None and step.safe_channel not in safe_numbers:
            continue  # that channel is somebody else's, and so is what the module falls back to there
        session.write(step.address, _registers(module, step, ticks, safe_numbers), unit)
    outcome = "0" if failsafe.safe_is is SafeIs.ZERO else "the safe set-points"
    takes_s = f"{ticks * failsafe.tick_s:g}"
    return {"failsafe": f"armed: outputs to {outcome} after {takes_s} s without a request", "watchdog_s": takes_s}


def _registers(module: ModuleMap, step: RegisterWrite, ticks: int, safe_numbers: Mapping[int, float]) -> list[int]:
    """What a step writes. A safe set-point has the form of the module's outputs: their type, and the order of their
    bytes and words."""
    if step.safe_channel is None or module.outputs is None:
        return [ticks if step.timeout else step.value]
    return encode(module.outputs, [safe_numbers[step.safe_channel]])


def disarm(session: ModbusSession, failsafe: Failsafe | None, unit: int) -> None:
    """Stop the watchdog, so that the outputs keep what was written last."""
    for step in failsafe.disarm if failsafe else ():
        session.write(step.address, [step.value], unit)
