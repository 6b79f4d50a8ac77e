"""The locks of what a rig is wired to."""

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from drivers.modbus_io.settings import ModbusSettings, SerialLine
from drivers.modbus_io.stations import rebuild
from drivers.serial_port import SerialPort
from rig.app import compose, shipped, supervise, wire_locks
from rig.config import unstructure
from rig.errors import DeviceLost, RigError
from rig.realtime import shared
from rig.realtime.clock import MonotonicClock

HOLD = (
    "import sys; from rig.app import wire_locks; wire_locks.hold(sys.argv[1:]); "
    "print('held', flush=True); sys.stdin.read()"
)


@pytest.fixture(autouse=True)
def own_table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(wire_locks, "TABLE", f"pamrigwire-{os.getpid()}-{tmp_path.name}")


@contextmanager
def another(*names: str) -> Iterator["subprocess.Popen[str]"]:
    """A process that holds these wires."""
    patched = HOLD.replace("; wire_locks.hold", f"; wire_locks.TABLE = {wire_locks.TABLE!r}; wire_locks.hold")
    process = subprocess.Popen(
        [sys.executable, "-c", patched, *names], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout
    assert process.stdout.readline() == "held\n"
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def test_a_wire_is_one_process_s_and_its_name_is_said() -> None:
    with another("10.0.0.1:502 unit 1") as other:
        assert wire_locks.who_drives(["10.0.0.2:502 unit 1"]) == ""
        assert f"process {other.pid} (" in wire_locks.who_drives(["10.0.0.1:502 unit 1"])
        assert wire_locks.who_drives(["10.0.0.1:502 unit 1"], other.pid) == ""
        assert wire_locks.who_drives(["10.0.0.1:502 unit 1"], int(str(other.pid)[:-1])) != ""
        with pytest.raises(DeviceLost, match=f"10.0.0.1:502 unit 1: driven by process {other.pid} .*; end that first"):
            wire_locks.hold(["10.0.0.1:502 unit 1"])


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_a_process_that_ends_lets_go_however_it_ends(number: int) -> None:
    with another("RIO0") as other:
        other.send_signal(number)
        other.wait()
        with wire_locks.held(["RIO0"]):
            assert f"process {os.getpid()} " in wire_locks.who_drives(["RIO0"])


def test_one_wire_in_use_takes_none() -> None:
    with another("b"):
        with pytest.raises(DeviceLost, match=r"^b: driven by"):
            wire_locks.hold(["a", "b"])
        assert wire_locks.who_drives(["a"]) == ""


def test_what_was_held_is_free_afterwards_and_looking_takes_nothing() -> None:
    with wire_locks.held(["a", "b"]):
        assert wire_locks.who_drives(["a"])
        with pytest.raises(DeviceLost):
            wire_locks.hold(["b"])
    assert wire_locks.who_drives(["a", "b"]) == ""
    with wire_locks.held(["a"]):
        pass


def test_nothing_lies_about_that_somebody_could_remove() -> None:
    """The lock was a file in /dev/shm: whoever cleaned up there (systemd-logind does, when a user logs out for the last
    time) let a second process drive the wire."""
    before = set(shared.folder().iterdir())
    with wire_locks.held(["a"]):
        assert {path.name for path in set(shared.folder().iterdir()) - before if "wire" in path.name} == set()
        with pytest.raises(DeviceLost):
            wire_locks.hold(["a"])


def test_a_holder_s_command_line_cannot_write_to_the_terminal() -> None:
    wire = "a\x1b[2Jprocess 1\n\u202e"
    with another(wire) as other:
        said = wire_locks.who_drives([wire]).removeprefix(wire)
    assert f"process {other.pid} (" in said
    assert said.isprintable()


def test_a_wire_whose_holder_says_nothing_of_itself_is_driven_all_the_same() -> None:
    held = wire_locks.hold(["a"])
    os.close(held.pop())
    assert wire_locks.who_drives(["a"]) == wire_locks.who_drives(["a"], os.getpid()) == "a is driven by another process"
    os.close(held.pop())
    assert wire_locks.who_drives(["a"]) == ""


def test_a_rig_s_wires_are_those_that_carry_set_points() -> None:
    assert compose.wires_of(compose.load(None)) == [], "a simulated rig has no wire"
    rigs = compose.load(None).path.parent
    modbus = compose.wires_of(compose.load(rigs / "all_modbus.yaml"))
    assert modbus, "a module"
    assert modbus == ["192.168.1.17:502", "192.168.1.17:502 unit 1"]
    serial = compose.load(rigs / "serial_modbus.yaml")
    assert all("/" in wire for wire in compose.wires_of(serial)), "its potentiometer's module is only read"


@pytest.mark.parametrize(
    ("line", "held"),
    [("host: 10.0.0.9", []), ("serial: {device: /dev/ttyUSB9}", ["/dev/ttyUSB9"])],
    ids=["a module on TCP", "a module on a serial line"],
)
def test_a_line_that_gives_each_byte_to_one_reader_is_held_by_who_only_reads_it(
    line: str, held: list[str], tmp_path: Path
) -> None:
    """Devices without a valve were not held: two processes that read one converter took bytes from each other."""
    rigs = shipped.configs() / "rigs"
    text = (rigs / "serial_modbus.yaml").read_text().replace("../modbus", str(rigs.parent / "modbus"))
    (address,) = [each for each in text.splitlines() if each.strip().startswith("host:")]
    (tmp_path / "rig.yaml").write_text(text.replace(address.strip(), line))
    rig = compose.load(tmp_path / "rig.yaml")
    assert sorted({*compose.held_wires(rig)} - {*compose.wires_of(rig)}) == held


def test_a_port_that_came_back_behind_its_link_as_another_is_the_same_wire(tmp_path: Path) -> None:
    """Who goes on in the place of a lost daemon looked for another driver at the port of before: the alarm reached him
    by the link, and ended his sweep."""
    link, ports = tmp_path / "by-id", [tmp_path / "ttyUSB0", tmp_path / "ttyUSB1"]
    port = SerialPort(str(link))
    seen = [set(port.wires)]
    for place in ports:
        link.unlink(missing_ok=True)
        link.symlink_to(place)
        seen.append(set(port.wires))
    unplugged, before, after = seen
    assert unplugged & before & after
    assert str(ports[0]) in before, "as who names the port itself has it"
    assert len(SerialPort("/dev/ttyS0").wires) == 1
    with wire_locks.held(sorted(before)):
        assert wire_locks.who_drives(sorted(after)) != ""


def test_who_only_reads_a_line_drives_nothing_by_it() -> None:
    """Whoever makes safe beside it is told of no other driver."""
    serial = compose.load(shipped.configs() / "rigs" / "serial_modbus.yaml")
    assert {*compose.wires_of(serial)} <= {*compose.held_wires(serial)}


def test_a_stand_in_that_others_can_write_to_is_a_wire(tmp_path: Path) -> None:
    """Two processes drove it; one that keeps its plant to itself is no wire."""
    text = compose.load(None).path.read_text().replace("../models/simulated.yaml", "simulated")
    faulty = text.replace("kind: simulated", f"kind: simulated_faulty, terminals: {tmp_path}/t")
    (tmp_path / "rig.yaml").write_text(faulty)
    assert compose.wires_of(compose.load(tmp_path / "rig.yaml")) == [str((tmp_path / "t").resolve())]


@pytest.mark.parametrize(
    ("first", "second", "apart"),
    [
        ({"unit": 1}, {"unit": 255}, False),
        ({"unit": 1, "gateway": True}, {"unit": 2, "gateway": True}, True),
        ({"unit": 1, "gateway": True}, {"unit": 1, "gateway": True}, False),
        ({"unit": 1, "gateway": True}, {"unit": 1}, False),
        ({"unit": 1}, {"unit": 1, "port": 503}, True),
    ],
)
def test_unit_ids_part_two_modules_behind_a_gateway_only(
    first: dict[str, Any], second: dict[str, Any], apart: bool
) -> None:
    """A module that ignores them was driven by two processes, each by an id of its own."""
    table = shipped.configs() / "modbus" / "wago_750.yaml"
    held = [set(ModbusSettings(map=table, host="10.0.0.1", **one).wires) for one in (first, second)]
    assert held[0].isdisjoint(held[1]) is apart


def test_a_rig_that_is_loaded_needs_the_map_of_its_module_no_more(tmp_path: Path) -> None:
    """Whoever was left to make safe read it again: a folder that is gone, or a map edited meanwhile, is in his way."""
    rigs = shipped.configs() / "rigs"
    table = tmp_path / "own_map.yaml"
    table.write_text((rigs.parent / "modbus" / "wago_750.yaml").read_text())
    text = (rigs / "all_modbus.yaml").read_text().replace("../modbus/wago_750.yaml", str(table))
    (tmp_path / "rig.yaml").write_text(text)
    rig = compose.load(tmp_path / "rig.yaml")
    before = compose.device_settings(rig.devices[0], rig, {})[1].module
    table.unlink()
    assert compose.device_settings(rig.devices[0], rig, {})[1].module == before
    compose.make_device(rig, MonotonicClock())
    assert compose.wires_of(rig) == ["192.168.1.17:502", "192.168.1.17:502 unit 1"]
    settings = compose.device_settings(rig.devices[0], rig, {})[1]
    assert rebuild(unstructure(settings)).module == before, "as the I/O process is told"


def test_a_gateway_has_no_serial_line() -> None:
    with pytest.raises(ValueError, match="gateway is for TCP"):
        ModbusSettings(map=Path("map.yaml"), serial=SerialLine("/dev/ttyS0"), gateway=True)


def test_a_safe_state_that_nobody_could_write_is_not_said_to_be_written(tmp_path: Path) -> None:
    """A module that is out of reach, or takes one connection, beside a process that drives it."""
    rigs = compose.load(None).path.parent
    text = (rigs / "all_modbus.yaml").read_text().replace("192.168.1.17", "127.0.0.1\n    port: 1")
    (tmp_path / "rig.yaml").write_text(text.replace("../modbus", str(rigs.parent / "modbus")))
    rig = compose.load(tmp_path / "rig.yaml")
    with another(*compose.wires_of(rig)), pytest.raises(RigError, match="NOT SAFE") as said:
        supervise.make_safe(rig)
    assert "was written" not in str(said.value)


def test_a_port_is_one_wire_by_each_of_its_links(tmp_path: Path) -> None:
    from drivers.serial_port import SerialPort

    port, link = tmp_path / "ttyUSB0", tmp_path / "by-id"
    port.touch()
    link.symlink_to(port)
    assert set(SerialPort(str(link)).wires) >= set(SerialPort(str(port)).wires)


def test_who_only_looks_keeps_nobody_from_a_wire() -> None:
    """A status asks for the driver each time, and must not be taken for one."""
    over, seen = threading.Event(), set[str]()

    def look() -> None:
        while not over.is_set():
            seen.add(wire_locks.who_drives(["RIO0"]))

    lookers = [threading.Thread(target=look) for _ in range(2)]
    for looker in lookers:
        looker.start()
    try:
        for rounds in range(20_000):
            with wire_locks.held(["RIO0"]):
                pass
            if rounds >= 500 and len(seen) > 1:  # they looked while it was held, and while it was free
                break
    except DeviceLost as taken:
        pytest.fail(f"whoever looked held the wire: {taken}")
    finally:
        over.set()
        for looker in lookers:
            looker.join()
    driven = seen - {""}
    assert "" in seen
    assert driven
    assert all(one.startswith("RIO0 is driven by ") for one in driven)
