"""Everything that a serial line can do to us, on the emulated regulators: each is named in one line, and none moves the
rig."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import closing, suppress
from pathlib import Path

import pytest
import serial
from support.rigs import fieldbus_rigs as rigs

from drivers.io_process.lookup import path_for
from drivers.io_process.mailbox import attach
from drivers.itv_serial.device import ItvSerial, ItvSettings
from drivers.serial_port import SerialPort
from hil.emulators.emulation import Emulation
from rig.errors import ConfigError, DeviceError, DeviceLost, DevicePending
from rig.interfaces import Measurement, Role
from rig.sample import Flag

HEALTHY = {"silence": False, "cut_answers": 0, "garble": 0.0, "late_s": 0.0, "noise": ""}


@pytest.fixture
def running() -> Iterator[Emulation]:
    running = rigs.valves("faulty_valves")
    yield running
    for name in ("valve_1", "valve_2"):
        running.plug(name)
        running.power(name, on=True)
        running.trouble(name, **HEALTHY)


@pytest.fixture
def device(running: Emulation) -> Iterator[ItvSerial]:
    device = rigs.serial_valves(running)
    yield device
    device.close()


def told(running: Emulation) -> tuple[int, int]:
    points = running.state()["set_points"]
    return points["valve_1"], points["valve_2"]


SAFE_COUNTS = (430, 389)
LEFT_COUNTS = (246, 696)


def errors_of(device: ItvSerial, says: str = "", seconds: float = 4.0) -> list[DeviceError]:
    """What `read` says until it says that: a busy machine may be late with an answer by itself, before."""
    found: list[DeviceError] = []

    def said() -> bool:
        try:
            device.read()
        except DeviceError as error:
            found.append(error)
        return bool(found) and re.search(says, str(found[-1])) is not None

    rigs.soon(said, seconds)
    return found


def refusal(settings: ItvSettings, *roles: Role) -> str:
    """The one line with which opening ends."""
    device = ItvSerial(settings, rigs.context(*(roles or rigs.VALVE_ROLES)))
    with pytest.raises(DeviceLost) as caught:
        device.open()
    assert "\n" not in str(caught.value)
    device.close()
    return str(caught.value)


def test_an_unknown_port_is_named_with_those_there_are(running: Emulation) -> None:
    text = refusal(ItvSettings(SerialPort("/dev/ttyNO7")), Role.VALVE_1)
    assert "valve_1 on /dev/ttyNO7: there is no such port; this machine has:" in text


def test_a_port_that_another_program_holds_is_named(running: Emulation) -> None:
    with serial.Serial(running.places["valve_1"], rigs.BAUD, exclusive=True):
        assert "in use by another program" in refusal(rigs.valve_settings(running))
    assert told(running) == LEFT_COUNTS


def test_a_second_pamrig_on_the_same_port_is_refused(running: Emulation, device: ItvSerial) -> None:
    device.open()
    assert "in use by another I/O process" in refusal(rigs.valve_settings(running))


@pytest.mark.parametrize("baud", [9600, 57600])
def test_the_wrong_baud_rate_is_named_and_moves_nothing(running: Emulation, baud: int) -> None:
    text = refusal(rigs.valve_settings(running, baud))
    assert f"at {baud} baud: check power, port, baud rate and dialect" in text
    assert told(running) == LEFT_COUNTS


def test_a_regulator_without_power_is_silent(running: Emulation) -> None:
    running.power("valve_2", on=False)
    text = refusal(rigs.valve_settings(running))
    assert "valve_2" in text
    assert "no answer within" in text


def test_another_dialect_is_named(running: Emulation) -> None:
    dialect = type(rigs.valve_settings(running).dialect)(monitor_command="PRESSURE?")
    assert "refused: 'UNKNOWN COMMAND'" in refusal(rigs.valve_settings(running, dialect=dialect))


@pytest.mark.parametrize(
    ("trouble", "says"),
    [
        ({"silence": True}, "no answer within"),
        ({"cut_answers": 2}, "no answer|without its end"),
        ({"garble": 1.0}, "."),
        ({"noise": "?"}, "without being asked|more came than|unexpected reply|garbled|without its end"),
        ({"late_s": 0.2}, "no answer within|without being asked"),
    ],
)
def test_trouble_on_the_line_is_a_device_error_then_heals(
    running: Emulation, device: ItvSerial, trouble: dict[str, object], says: str
) -> None:
    device.open()
    device.write(0.3, 0.1)
    assert rigs.soon(lambda: told(running) == (614, 205))
    running.trouble("valve_1", **trouble)
    found = errors_of(device, says)
    assert found
    assert re.search(says, str(found[-1])), found
    assert not [error for error in found if "\n" in str(error)]
    running.trouble("valve_1", **HEALTHY)

    def healed() -> bool:
        try:
            return not device.read().flags & Flag.P1_ABSENT
        except DeviceLost:
            device.close()
            device.open()
            return False
        except DeviceError:
            return False

    assert rigs.soon(healed, 10.0)


def test_late_answers_never_pass_as_new_ones(running: Emulation, device: ItvSerial) -> None:
    """Answers later than the patience: values may be missing, but the answer to one command is never taken for
    another's."""
    device.open()
    device.write(0.4, 0.4)
    assert rigs.soon(lambda: abs(device.read().p1_mpa - 0.4) < 0.01)
    running.trouble("valve_1", late_s=0.15)
    seen: list[Measurement] = []

    def gather() -> bool:
        try:
            seen.append(device.read())
            device.write(0.1 + 0.001 * len(seen) % 0.2, 0.4)  # set-points unlike any pressure here
        except DeviceError:
            pass
        return False

    rigs.soon(gather, 1.5)
    assert all(now.flags & Flag.P1_ABSENT or now.p1_age_ns < 2_000_000_000 for now in seen)
    lowest = min(now.p1_mpa for now in seen if not now.flags & Flag.P1_ABSENT)
    assert lowest > 0.09, "a set-point's confirmation was read as a pressure"


@pytest.mark.parametrize("heard", [True, False])
def test_power_off_and_on_while_driving_ends_at_the_safe_set_point(
    running: Emulation, device: ItvSerial, heard: bool
) -> None:
    """The regulator comes back with a set-point of its own; the I/O process then writes the safe one and keeps to
    it. It wrote the old one where the regulator had obeyed and its reply had been late or lost."""
    device.open()
    running.trouble("valve_1", silence=not heard)
    device.write(0.4, 0.1)
    assert rigs.soon(lambda: told(running) == (818, 205))
    running.power("valve_1", on=False)

    assert rigs.soon(lambda: rigs.is_lost(device.read), 10.0)
    running.trouble("valve_1", silence=False)
    running.power("valve_1", on=True)
    assert rigs.soon(lambda: told(running)[0] == SAFE_COUNTS[0], 10.0)
    with pytest.raises(DeviceLost, match="close and open again"):
        device.write(0.3, 0.3)


@pytest.mark.parametrize("killed", [False, True])
def test_a_regulator_that_is_heard_no_more_is_told_its_safe_set_point(
    running: Emulation, device: ItvSerial, killed: bool
) -> None:
    """The wire of its answers is broken: it obeys, and nobody can see it. Nothing was sent once the line counted as
    lost, or its process was gone."""
    safe = rigs.SAFE[0]
    device.open()
    device.write(0.3, 0.3)
    assert rigs.soon(lambda: running.state()["commands_mpa"] == pytest.approx([0.3, 0.3], abs=0.001))
    running.trouble("valve_1", silence=True)
    if killed:
        behind = attach(path_for(running.places["valve_1"]))
        assert behind is not None
        os.kill(behind.pid, signal.SIGKILL)
        behind.close()

    assert rigs.soon(lambda: rigs.is_lost(device.read), 20.0)

    def made_safe() -> bool:
        with suppress(DeviceError):
            device.safe()
        return running.state()["commands_mpa"][0] == pytest.approx(safe, abs=0.001)

    assert rigs.soon(made_safe, 10.0)
    with pytest.raises(DeviceError):  # which nobody has seen
        device.holds_safe()
    with pytest.raises(DeviceLost, match="no answer within"):  # who wants to drive it is to hear it first
        device.open()


def test_a_killed_io_process_is_noticed_and_safe_starts_another(running: Emulation, device: ItvSerial) -> None:
    device.open()
    device.write(0.4, 0.1)
    assert rigs.soon(lambda: told(running) == (818, 205))
    for pid in _io_processes():
        os.kill(pid, signal.SIGKILL)
    found = errors_of(device)
    assert isinstance(found[0], DeviceLost)
    assert "the I/O process is gone" in str(found[0])
    assert rigs.soon(lambda: not _fails(device.safe), 10.0), "called again and again, as the loop does"
    assert rigs.soon(lambda: told(running) == SAFE_COUNTS)


def _fails(call: Callable[[], None]) -> bool:
    try:
        call()
    except DeviceError:
        return True
    return False


def _io_processes() -> list[int]:
    """Our own children that are I/O processes."""
    children = Path(f"/proc/self/task/{os.getpid()}/children").read_text().split()
    return [int(pid) for pid in children if b"drivers.io_process" in Path(f"/proc/{pid}/cmdline").read_bytes()]


OWNER = """
import json, sys, time
from drivers.io_process.lookup import path_for
from drivers.io_process.mailbox import attach
from drivers.itv_serial.device import ItvSerial, ItvSettings
from drivers.serial_port import SerialPort
from rig.interfaces import DeviceContext, Role
from rig.realtime.clock import MonotonicClock
first, second, baud = json.loads(sys.argv[1])
roles = frozenset({Role.VALVE_1, Role.VALVE_2, Role.MONITOR_1, Role.MONITOR_2})
settings = ItvSettings(SerialPort(first, baud), SerialPort(second, baud), silence_periods=10)
device = ItvSerial(settings, DeviceContext(MonotonicClock(), roles, 0.21, 0.19))
device.open()
device.write(0.4, 0.1)
print("driving", flush=True)
while True:
    device.write(0.4, 0.1)
    time.sleep(0.005)
"""


@pytest.fixture
def owner(running: Emulation) -> Iterator[subprocess.Popen[bytes]]:
    """A process that drives both valves, as the loop does."""
    where = json.dumps([running.places["valve_1"], running.places["valve_2"], rigs.BAUD])
    with subprocess.Popen([sys.executable, "-c", OWNER, where], stdout=subprocess.PIPE, env=_env()) as process:
        assert process.stdout
        assert process.stdout.readline() == b"driving\n"
        assert rigs.soon(lambda: told(running) == (818, 205))
        yield process
        process.kill()


def _env() -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}


@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGSTOP])
def test_an_owner_that_is_killed_or_stopped_leaves_safe_valves(
    running: Emulation, owner: "subprocess.Popen[bytes]", end: signal.Signals
) -> None:
    """Nobody else is there: the I/O process sees the closed pipe, or the silence, and writes the safe set-points
    itself."""
    owner.send_signal(end)
    assert rigs.soon(lambda: told(running) == SAFE_COUNTS), told(running)


def write_safe(device: ItvSerial) -> int:
    """As a watcher does it: asked again while the wires have not carried it. Returns how often."""
    waits = 0
    while True:
        try:
            device.safe()
        except DevicePending:
            waits += 1
        else:
            return waits


def test_the_supervisors_instance_reaches_the_ports_that_the_loop_holds(
    running: Emulation, owner: "subprocess.Popen[bytes]", device: ItvSerial
) -> None:
    write_safe(device)
    assert rigs.soon(lambda: told(running) == SAFE_COUNTS)
    time.sleep(0.1)
    assert told(running) == SAFE_COUNTS, "the loop that still drives is not obeyed any more"


def test_two_who_each_hold_a_port_both_come_to_see_the_safe_state(running: Emulation) -> None:
    """Supervisor and guardian, each by the other's I/O process: what was done between two looks, four in a second, was
    asked for anew at each of them, and neither ever called the rig safe."""
    settings = rigs.valve_settings(running)
    with closing(ItvSerial(settings, rigs.context(Role.VALVE_1))) as first:
        first.safe()
        running.trouble("valve_1", late_s=0.05)
        both = rigs.context(Role.VALVE_1, Role.VALVE_2, period_ns=5_000_000)
        with closing(ItvSerial(settings, both)) as second:
            for _ in range(8):
                with suppress(DeviceError):
                    second.safe()
                    break
                time.sleep(0.25)
            else:
                raise AssertionError("it stands there, and is asked for again and again")
            assert second.holds_safe() is True
    assert told(running) == SAFE_COUNTS


def test_safe_returns_when_the_wires_have_carried_it() -> None:
    """It returned at once, and a status right after a stop said "safe" of what stood in a queue."""
    running = rigs.valves("slow_valves", 9600)
    context = rigs.context(*rigs.VALVE_ROLES, period_ns=5_000_000)
    with closing(ItvSerial(rigs.valve_settings(running, 9600), context)) as device:
        device.open()
        device.write(0.3, 0.3)
        assert rigs.soon(lambda: running.state()["commands_mpa"] == pytest.approx([0.3, 0.3], abs=0.001))
        waits = write_safe(device)
        assert told(running) == SAFE_COUNTS
        assert waits
        assert device.holds_safe() is True


def test_roles_without_a_port_and_one_port_for_two_are_config_errors() -> None:
    with pytest.raises(ConfigError, match="'valve_2' needs the port of its valve"):
        ItvSerial(ItvSettings(SerialPort("/dev/ttyS0")), rigs.context(Role.VALVE_1, Role.VALVE_2))
    with pytest.raises(ConfigError, match="each valve needs its own port"):
        ItvSerial(ItvSettings(SerialPort("/dev/ttyS0"), SerialPort("/dev/ttyS0")), rigs.context(Role.VALVE_1))
    with pytest.raises(ConfigError, match="angle"):
        ItvSerial(ItvSettings(SerialPort("/dev/ttyS0")), rigs.context(Role.ANGLE))


def test_what_the_valves_really_get_is_among_the_facts(running: Emulation, device: ItvSerial) -> None:
    facts = device.open()
    assert "set-points/s reach the valve" in facts["valve_1.pace"]
    assert float(facts["valve_2.set_rate_hz"]) == pytest.approx(1 / (27 * 10 / rigs.BAUD), rel=0.01)
