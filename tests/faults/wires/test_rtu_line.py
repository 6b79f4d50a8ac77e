"""A Modbus RTU line at its worst: whatever comes back on it, no value is older than it is said to be, nothing is called
written or safe that is not, and it works again afterwards."""

import contextlib
import time
from collections.abc import Iterator

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from support.rigs import fieldbus_rigs as rigs
from support.rigs.spoilt_rtu import AFTERWARDS, MAP, QUICK, SpoiltModule

from drivers.io_process.lookup import find
from drivers.modbus_io.device import ModbusIo
from drivers.modbus_io.link import ModbusLink
from drivers.modbus_io.settings import ModbusSettings, SerialLine
from rig.errors import DeviceError, DeviceLost
from rig.interfaces import Role

PATIENCE_S = 0.03
ROLES = (Role.VALVE_1, Role.VALVE_2, Role.MONITOR_1, Role.MONITOR_2)
SAFE = {0: 1000.0, 1: 2000.0}
DRIVEN = (30_000.0, 40_000.0)


@pytest.fixture(scope="module")
def module(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SpoiltModule]:
    folder = tmp_path_factory.mktemp("line")
    (folder / "map.yaml").write_text(MAP, encoding="utf-8")
    module = SpoiltModule(folder / "port", late_s=0.1)
    yield module
    module.stop()


@pytest.fixture(autouse=True)
def _fresh(module: SpoiltModule) -> None:
    module.ways.clear()
    module.mute = module.overdue = False
    module.outputs[:] = 0, 0


def wired(module: SpoiltModule) -> ModbusSettings:
    channels = {role.value: rigs.CHANNELS[role.value] for role in ROLES}
    line = SerialLine(str(module.device), 9600, "N", 2)
    return ModbusSettings(module.device.parent / "map.yaml", serial=line, patience_s=PATIENCE_S, **channels)


@contextlib.contextmanager
def linked(module: SpoiltModule) -> Iterator[ModbusLink]:
    link = ModbusLink(wired(module), frozenset(ROLES), SAFE)
    try:
        yield link
    finally:
        link.close()
        link._loop.close()  # noqa: SLF001  # its process takes it with it


def test_a_reply_that_came_twice_answers_no_later_request(module: SpoiltModule) -> None:
    """It was taken for the next one's, and every value from then on was that of the request before."""
    with linked(module) as link:
        link.connect()
        for _ in range(5):
            module.ways.append("twice, a little later")
            number, asked_ns = link.exchange(None, False, False).values[0]
            assert module.sampled_ns[int(number)] >= asked_ns


def test_an_adapter_that_echoes_is_named(module: SpoiltModule) -> None:
    """It was "no usable answer in time"."""
    module.ways.extend(["echo"] * 4)
    says = "each request comes back as it was sent: switch the echo of the adapter off"
    with linked(module) as link, pytest.raises(DeviceError, match=says):
        link.connect()


def test_a_module_that_is_not_heard_any_more_is_told_to_be_safe(module: SpoiltModule) -> None:
    """What drove it waited for an answer before it wrote anything, for ever, and the set-points stayed."""
    device = ModbusIo(wired(module), rigs.context(*ROLES))
    device.open()
    device.write(0.4, 0.3)
    assert rigs.soon(lambda: module.outputs[0] > 50_000)
    module.mute = True
    assert rigs.soon(lambda: rigs.is_lost(device.read), 10.0)
    safe = [round(pressure / 0.5 * 65535) for pressure in rigs.SAFE]
    assert rigs.soon(lambda: module.outputs == safe, 10.0)
    device.close()


def test_a_reply_that_is_lost_while_it_is_made_safe_costs_no_io_process(module: SpoiltModule, driven: ModbusIo) -> None:
    """Whoever drives it tries again a moment later. He was ended, and the set-points stayed for as long as another
    takes to start."""
    serves, failed = served_by(module), list[str]()
    module.ways.extend(["silent"] * 3)

    def made_safe() -> bool:
        try:
            driven.safe()
        except DeviceError as error:
            failed.append(str(error))
            return False
        return True

    assert rigs.soon(made_safe, 10.0)
    assert any("no usable answer in time" in one for one in failed)
    assert served_by(module) == serves


def test_after_a_standstill_of_all_the_one_who_serves_the_line_is_not_replaced(
    module: SpoiltModule, driven: ModbusIo, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whoever moved first found the others silent for as long as all of them had stood still."""
    driven.read()
    serves, now_ns = served_by(module), time.monotonic_ns
    module.ways.extend(["silent"] * 100)
    with monkeypatch.context() as patch:
        patch.setattr(time, "monotonic_ns", lambda: now_ns() + 60_000_000_000)
        with pytest.raises(DeviceError):
            driven.safe()
    module.ways.clear()
    assert rigs.soon(lambda: is_made_safe(driven), 10.0)
    assert served_by(module) == serves


@pytest.fixture
def driven(module: SpoiltModule) -> Iterator[ModbusIo]:
    """By an I/O process, away from its safe set-points."""
    device = ModbusIo(wired(module), rigs.context(*ROLES))
    device.open()
    device.write(0.4, 0.3)
    assert rigs.soon(lambda: module.outputs[0] > 50_000)
    yield device
    device.close()


def is_made_safe(device: ModbusIo) -> bool:
    with contextlib.suppress(DeviceError):
        device.safe()
        return True
    return False


def served_by(module: SpoiltModule) -> int:
    """Pid of the I/O process that has the line."""
    found = find(str(module.device))
    assert found is not None
    with contextlib.closing(found[1]):
        return found[1].pid


def test_who_rescues_tells_a_module_that_is_not_heard(module: SpoiltModule) -> None:
    """The process that drove it is gone: nobody knows whether it ever answered."""
    module.mute, module.outputs[:] = True, (30_000, 40_000)
    device = ModbusIo(wired(module), rigs.context(*ROLES))
    with pytest.raises(DeviceError):
        device.safe()
    assert module.outputs == [round(pressure / 0.5 * 65535) for pressure in rigs.SAFE]
    device.close()


def test_who_only_looks_tells_it_nothing(module: SpoiltModule) -> None:
    with linked(module) as link:
        link.connect()
        module.mute, module.outputs[:] = True, (30_000, 40_000)
        with pytest.raises(DeviceError):
            link.connect()
    assert module.outputs == [30_000, 40_000]


DO = st.sampled_from(["read", "drive", "safe", "pull the plug"])
WAYS = st.lists(st.sampled_from(QUICK + AFTERWARDS), max_size=2)


@settings(max_examples=25, deadline=None, suppress_health_check=list(HealthCheck))
@given(st.lists(st.tuples(DO, WAYS), min_size=1, max_size=8))
def test_whatever_the_line_does_nothing_is_said_that_is_not_so(
    module: SpoiltModule, steps: list[tuple[str, list[str]]]
) -> None:
    module.ways.clear()
    module.overdue = False
    with linked(module) as link:
        up = _carried_out(link, module, steps)
        module.ways.clear()
        assert any(_is_safe(link, module, again=bool(tries) or not up) for tries in range(20))


def _carried_out(link: ModbusLink, module: SpoiltModule, steps: list[tuple[str, list[str]]]) -> bool:
    """Whether it is connected then."""
    up = False
    for number, (do, ways) in enumerate(steps):
        if do == "pull the plug":
            module.unplug()
            module.plug()
            continue
        clean = not module.ways and not ways
        module.ways.extend(ways)
        outputs = {"drive": (DRIVEN[0] + number, DRIVEN[1]), "safe": (SAFE[0], SAFE[1])}.get(do)
        try:
            if not up:
                link.connect()
                up = True
            done = link.exchange(outputs, outputs is not None, do == "safe")
        except DeviceError as error:
            if up := not isinstance(error, DeviceLost) and up:
                assume(not clean)  # a whole reply in time, and late all the same: the machine stood still
            else:
                link.close()
            continue
        assume(not module.overdue)
        if done.sent and outputs is not None:
            assert module.outputs == [round(one) for one in outputs]
        for place, (value, asked_ns) in done.values.items():
            assert value == 7 if place else module.sampled_ns[int(value)] >= asked_ns
    return up


def _is_safe(link: ModbusLink, module: SpoiltModule, *, again: bool) -> bool:
    with contextlib.suppress(DeviceError):
        if again:
            link.connect()
        return link.exchange((SAFE[0], SAFE[1]), True, True).sent and module.outputs == [1000, 2000]
    return False
