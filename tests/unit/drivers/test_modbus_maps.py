"""The maps that come with pamrig against the manuals' numbers, and what a wrong map, wiring or setting says, in one
line."""

import dataclasses
import json
from pathlib import Path
from typing import Any, cast

import pytest
from support.rigs import fieldbus_rigs as rigs

from drivers.itv_serial.device import ItvSerial, ItvSettings
from drivers.modbus_io import failsafe
from drivers.modbus_io.codec import decode, encode, rtu_exchange_s, to_counts
from drivers.modbus_io.device import ModbusIo
from drivers.modbus_io.maps import ChannelRun, ModuleMap, Type, load_map
from drivers.modbus_io.plan import Write, make_plan
from drivers.modbus_io.settings import ExchangeMode, ModbusAngleChannel, ModbusSettings, PressureChannel, SerialLine
from drivers.modbus_io.stations import Stations
from drivers.serial_port import SerialPort
from drivers.signals import SignalRange
from rig.config import structure
from rig.errors import ConfigError, DeviceError
from rig.interfaces import Role

ALL = frozenset(Role)


def counts(block: ChannelRun | None, signal: float) -> int:
    """The register that stands for a signal."""
    assert block
    return encode(block, [to_counts(block, signal)])[0]


def test_the_adam_6024() -> None:
    """ADAM-6000 manual, B.2.4: AI 40001-40006, AO 40011-40012; address = number - 40001."""
    module = load_map(rigs.MAPS / "adam_6024.yaml")
    assert module.inputs
    assert module.outputs
    assert (module.inputs.address, module.inputs.channels) == (40001 - 40001, 6)
    assert (module.outputs.address, module.outputs.channels) == (40011 - 40001, 2)
    assert counts(module.outputs, 10.0) == 4095
    assert decode(module.inputs, [65535]) == [65535.0]
    assert not module.read_write
    assert module.failsafe is None


def test_the_moxa_pair() -> None:
    """E1200 manual, appendix A: E1241 AO raw 0x0400-0x0403; E1240 AI raw 30001-30008; modelName at 5000."""
    out, into = load_map(rigs.MAPS / "moxa_e1241.yaml"), load_map(rigs.MAPS / "moxa_e1240.yaml")
    assert out.outputs
    assert into.inputs
    assert (out.outputs.address, out.outputs.channels, out.inputs) == (0x0400, 4, None)
    assert (into.inputs.address, into.inputs.channels, into.inputs.function, into.outputs) == (0, 8, 4, None)
    assert {module.identity.address for module in (out, into) if module.identity} == {5000}


@pytest.mark.parametrize(("volts", "register"), [(0.0, 0), (1.25, 4096), (2.5, 8192), (5.0, 16384), (10.0, 32767)])
def test_the_wago_750_559(volts: float, register: int) -> None:
    """750-559 manual, 2.1.1.7.1, the table of process values."""
    module = load_map(rigs.MAPS / "wago_750.yaml")
    assert abs(counts(module.outputs, volts) - register) <= 1
    assert module.read_write
    assert module.failsafe
    assert [step.address for step in module.failsafe.arm] == [0x1008, 0x1000, 0x1001, 0x1002, 0x1003, 0x1003]
    assert module.failsafe.tick_s == 0.1


OUTPUTS = {"address": 100, "channels": 4}
MAP: dict[str, Any] = {"name": "m", "source": "s", "inputs": {"address": 0, "channels": 4, "function": 4}}


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"inputs": None}, "needs inputs or outputs"),
        ({"inputs": {"address": 0, "channels": 4}}, "function 16 cannot read"),
        ({"inputs": {**MAP["inputs"], "counts": [0, 70000]}}, "do not fit uint16"),
        ({"inputs": {**MAP["inputs"], "counts": [5, 5]}}, "counts must rise"),
        ({"inputs": {**MAP["inputs"], "signal_unit": "bar"}}, "allowed: V, mA"),
        ({"inputs": {**MAP["inputs"], "type": "uint8"}}, "unknown value 'uint8'"),
        ({"inputs": {**MAP["inputs"], "address": 65533}}, "run past 65535"),
        ({"outputs": {"address": 0, "channels": 4, "function": 6}}, "allowed: 16"),
        ({"identity": {"address": 0, "count": 1}}, "either registers or text"),
        ({"failsafe": {"arm": []}}, "at least one step"),
        ({"failsafe": {"arm": [{"address": 1}], "safe_is": "hold"}}, "allowed: registers, zero"),
        (
            {
                "outputs": {"address": 0, "channels": 2, "type": "float32", "counts": [0, 10]},
                "failsafe": {"arm": [{"address": 200, "safe_channel": 0}, {"address": 201, "safe_channel": 1}]},
            },
            "the safe set-point at 200 takes 2 registers, and the next one is at 201",
        ),
        (
            {"outputs": OUTPUTS, "failsafe": {"arm": [{"address": 200, "safe_channel": 4}]}},
            "safe_channel 4 at 200: the module has no such output channel, but 4, counted from 0",
        ),
        ({"failsafe": {"arm": [{"address": 200, "safe": 1}]}}, "unknown key 'safe'"),
        ({"unit": 250}, "outside 0 .. 247"),
        ({"adress": 3}, "unknown key 'adress'"),
    ],
)
def test_a_broken_map_is_one_line(change: dict[str, Any], says: str) -> None:
    with pytest.raises(ConfigError) as caught:
        structure({**MAP, **change}, ModuleMap, "map.yaml")
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


class Written:
    """A session that remembers what was written."""

    def __init__(self) -> None:
        self.writes: list[tuple[int, list[int]]] = []

    def write(self, address: int, registers: list[int], _unit: int) -> None:
        self.writes.append((address, registers))


FLOATS = {"address": 0, "channels": 2, "type": "float32", "word_order": "little", "counts": [0, 10], "signal": [0, 10]}


def test_the_safe_registers_of_a_fail_safe_have_the_form_of_the_outputs() -> None:
    """Type, bytes and words: a module that takes floats would have gone to 0 V or nowhere."""
    steps = [{"address": 200, "safe_channel": 0}, {"address": 202, "safe_channel": 1}]
    arm = [*steps, {"address": 204, "timeout": True}]
    module = structure({**MAP, "outputs": FLOATS, "failsafe": {"arm": arm}}, ModuleMap, "map.yaml")
    bus, block = Written(), module.outputs
    assert block
    failsafe.arm(cast(Any, bus), module, 1, 0.5, {0: 3.75, 1: 0.25})
    assert dict(bus.writes) == {200: encode(block, [3.75]), 202: encode(block, [0.25]), 204: [5]}
    assert [decode(block, registers) for _, registers in bus.writes[:2]] == [[3.75], [0.25]]


def test_a_module_that_takes_volts_is_given_more_than_whole_ones(tmp_path: Path) -> None:
    place = tmp_path / "volts.yaml"
    place.write_text(json.dumps({**MAP, "outputs": FLOATS}), encoding="utf-8")
    valves = dataclasses.replace(rigs.context(), roles=frozenset({Role.VALVE_1, Role.VALVE_2}))
    device = ModbusIo(settings(map=place), valves)
    assert device.numbers(0.2, 0.2125) == pytest.approx({0: 4.0, 1: 4.25})


SAFE_REGISTERS = {
    "safe_is": "registers",
    "arm": [{"address": 200 + channel, "safe_channel": channel} for channel in (0, 1, 2)],
}
SAFE_MAP = {**MAP, "outputs": OUTPUTS, "failsafe": SAFE_REGISTERS}


def test_a_safe_register_gets_the_set_point_of_the_valve_that_is_wired_to_its_channel(tmp_path: Path) -> None:
    """Valve 1 on channel 2 and valve 2 on channel 0: by the valves' numbers channel 0 fell back to valve 1's value, and
    channel 2 to whatever stood there."""
    place = tmp_path / "map.yaml"
    place.write_text(json.dumps(SAFE_MAP), encoding="utf-8")
    wired = settings(map=place, valve_1=PressureChannel(2), valve_2=PressureChannel(0))
    bus = Written()
    session = cast(Any, bus)
    Stations(session, session, make_plan(wired, frozenset({Role.VALVE_1, Role.VALVE_2}))).arm(0.5, {0: 11.0, 1: 22.0})
    assert bus.writes == [(200, [22]), (202, [11])]


def test_a_valve_whose_channel_has_no_safe_register_is_refused(tmp_path: Path) -> None:
    place = tmp_path / "map.yaml"
    place.write_text(json.dumps(SAFE_MAP), encoding="utf-8")
    wired = settings(map=place, valve_2=PressureChannel(3))
    with pytest.raises(
        ConfigError, match=r"valve_2 on output channel 3 of .*: failsafe\.arm of its map has no step with"
    ):
        make_plan(wired, frozenset({Role.VALVE_2}))
    place.write_text(json.dumps({**SAFE_MAP, "failsafe": SAFE_REGISTERS | {"safe_is": "zero"}}), encoding="utf-8")
    assert make_plan(wired, frozenset({Role.VALVE_2})).driven == {1: 3}


class Refusing(Written):
    """A module that refuses what touches one of its registers, all at once as modules do, and goes silent at
    another."""

    doubtful = False

    def __init__(self, refused: int, silent: int = -1) -> None:
        super().__init__()
        self.refused, self.silent, self.asked = refused, silent, 0

    def write(self, address: int, registers: list[int], unit: int) -> None:
        self.asked += 1
        touched = range(address, address + len(registers))
        self.doubtful = self.silent in touched
        if self.doubtful or self.refused in touched:
            raise DeviceError(f"register {address}: no")
        super().write(address, registers, unit)


@pytest.mark.parametrize("channels", [(0, 1), (0, 2), (2, 0)])
@pytest.mark.parametrize("broken", [0, 1])
@pytest.mark.parametrize("armed", [False, True])
def test_an_output_that_is_refused_leaves_no_pressure_on_the_other(
    tmp_path: Path, channels: tuple[int, int], broken: int, armed: bool
) -> None:
    """The second valve was never written to when the first was refused, nor any when both go in one write, and none
    past a fail-safe that took no safe set-point for the broken one."""
    place = tmp_path / "map.yaml"
    place.write_text(json.dumps(SAFE_MAP if armed else {**MAP, "outputs": OUTPUTS}), encoding="utf-8")
    wired = settings(map=place, valve_1=PressureChannel(channels[0]), valve_2=PressureChannel(channels[1]))
    bus = Refusing(100 + channels[broken])
    session = cast(Any, bus)
    stations = Stations(session, session, make_plan(wired, frozenset({Role.VALVE_1, Role.VALVE_2})))
    with pytest.raises(DeviceError, match="no"):
        stations.write_safe({0: 11.0, 1: 22.0}, 0.5)
    assert (100 + channels[1 - broken], [22 - 11 * broken]) in bus.writes


def test_a_module_that_is_silent_is_not_asked_for_the_other_output_as_well(tmp_path: Path) -> None:
    """Each question takes two fifths of a period."""
    place = tmp_path / "map.yaml"
    place.write_text(json.dumps(SAFE_MAP), encoding="utf-8")
    wired = settings(map=place, valve_1=PressureChannel(0), valve_2=PressureChannel(2))
    bus = Refusing(-1, silent=100)
    session = cast(Any, bus)
    stations = Stations(session, session, make_plan(wired, frozenset({Role.VALVE_1, Role.VALVE_2})))
    with pytest.raises(DeviceError):
        stations.write({0: 11.0, 1: 22.0})
    assert bus.asked == 1


def settings(**changes: Any) -> ModbusSettings:
    return rigs.modbus_settings(502, **changes)


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"valve_2": None}, "valve_2 is wanted from 127.0.0.1:502, but its channel is not set"),
        ({"valve_2": PressureChannel(4)}, "output channel 4 does not exist; allowed: 0 .. 3"),
        ({"valve_2": PressureChannel(0)}, "both valves on output channel 0"),
        (
            {"valve_1": PressureChannel(0, SignalRange.MA_4_20)},
            "a signal of 4-20 mA does not fit an output of 0 .. 10 V",
        ),
        ({"angle": ModbusAngleChannel(7, reference_v=5.0)}, "angle.wiper: .* has no input channel 7; allowed: 0 .. 3"),
        ({"angle": ModbusAngleChannel(1, reference_v=5.0)}, "monitor_2 and angle.wiper are both on input channel 1"),
        ({"monitor_2": PressureChannel(0, SignalRange.V_1_5)}, "monitor_1 and monitor_2 are both on input channel 0"),
        ({"map": rigs.MAPS / "moxa_e1241.yaml"}, "angle.wiper: Moxa ioLogik E1241 has no inputs"),
        ({"map": rigs.MAPS / "nothing.yaml"}, "no such file"),
    ],
)
def test_a_wrong_wiring_is_one_line_before_anything_is_opened(changes: dict[str, Any], says: str) -> None:
    with pytest.raises(ConfigError, match=says) as caught:
        make_plan(settings(**changes), ALL)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("raw", "says"),
    [
        ({}, "either host .TCP. or serial .RTU."),
        ({"host": "a", "serial": {"device": "b"}}, "either host .TCP. or serial .RTU."),
        ({"serial": {"device": "b"}, "mode": "combined"}, "not possible on RTU"),
        ({"serial": {"device": "b", "parity": "M"}}, "allowed: N, E, O"),
        ({"host": "a", "input_unit": 2}, "need input_map"),
        ({"host": "a", "angle": {"wiper": 2}}, "either excitation"),
        ({"host": "a", "mode": "fast"}, "unknown value 'fast'"),
        ({"host": "a", "port": 0}, "outside 1 .. 65535"),
    ],
)
def test_wrong_settings_are_one_line(raw: dict[str, Any], says: str) -> None:
    with pytest.raises(ConfigError, match=says):
        structure({"map": "m.yaml", **raw}, ModbusSettings, "rig.yaml: devices.io")


def test_neighbours_change_together_and_a_gap_is_left_alone() -> None:
    plan = make_plan(settings(), ALL)
    assert plan.writes == (Write(0, (0, 1)),)
    assert plan.can_combine
    apart = make_plan(settings(valve_1=PressureChannel(3), valve_2=PressureChannel(1)), ALL)
    assert apart.writes == (Write(1, (1,)), Write(3, (0,)))
    assert not apart.can_combine
    turned = make_plan(settings(valve_1=PressureChannel(1), valve_2=PressureChannel(0)), ALL)
    assert turned.encode(turned.writes[0], [100.0, 200.0]) == [200, 100]


def test_only_the_wanted_inputs_are_read() -> None:
    plan = make_plan(settings(), frozenset({Role.MONITOR_2, Role.ANGLE}))
    assert (plan.first_register, plan.registers, plan.picks) == (1, 3, {1: 0, 2: 1, 3: 2})
    assert plan.pick([10, 20, 30]) == {1: 10.0, 2: 20.0, 3: 30.0}
    nothing = make_plan(settings(), frozenset({Role.VALVE_1}))
    assert (nothing.registers, nothing.driven) == (0, {0: 0})


def test_two_registers_a_channel_keep_their_places(tmp_path: Path) -> None:
    table = tmp_path / "floats.yaml"
    block = "{function: 3, address: 40, channels: 6, type: float32, counts: [0, 10], signal: [0, 10]}"
    table.write_text(
        f"name: floats\nsource: test\ninputs: {block}\noutputs: "
        f"{block.replace('function: 3, address: 40', 'address: 80')}\n"
    )
    plan = make_plan(
        settings(map=table, valve_1=PressureChannel(2), valve_2=PressureChannel(3)),
        frozenset({Role.MONITOR_2, *rigs.VALVE_ROLES[:2]}),
    )
    assert (plan.first_register, plan.registers) == (42, 2)
    assert plan.writes == (Write(84, (0, 1)),)
    assert plan.pick(encode(plan.inputs, [2.5])) == {1: 2.5}


def test_the_rtu_wire() -> None:
    """19200 baud, 11 bits a byte: 8 + 13 bytes are 12.0 ms, and 3.5 silent characters around each frame 4.0 ms more."""
    assert rtu_exchange_s(19200, 11, 8, 13) == pytest.approx((21 + 7) * 11 / 19200)
    assert rtu_exchange_s(115200, 11, 8, 13) == pytest.approx(21 * 11 / 115200 + 0.0035)
    line = SerialLine("/dev/ttyS0", 115200)
    assert line.bits_per_byte == 11
    both = make_plan(settings(host="", serial=line, mode=ExchangeMode.AUTO), ALL).round_s(line)
    assert both == pytest.approx(rtu_exchange_s(115200, 11, 17, 13))
    split = make_plan(
        settings(host="", serial=line, mode=ExchangeMode.AUTO, map=rigs.MAPS / "adam_6024.yaml"), ALL
    ).round_s(line)
    assert split == pytest.approx(rtu_exchange_s(115200, 11, 8, 13) + rtu_exchange_s(115200, 11, 13, 8))


def test_a_float_that_is_too_large_is_clamped_not_an_error() -> None:
    block = ChannelRun(0, 1, (0.0, 10.0), type=Type.FLOAT32)
    assert decode(block, encode(block, [1e300])) == [10.0]


@pytest.mark.parametrize("kind", ["modbus", "serial"])
def test_a_calibrated_valve_is_told_what_brings_the_pressure(kind: str) -> None:
    """A regulator that gives 0.49 MPa for 0.5: for 0.245 it must be told 0.25, half of its scale."""
    calibration = {"valve_1": {"knots": [[0.0, 0.0], [0.5, 0.49]], "raw_unit": "MPa"}}
    context = dataclasses.replace(rigs.context(*rigs.VALVE_ROLES), calibration=calibration)
    if kind == "modbus":
        device = ModbusIo(settings(), context)
        assert device.numbers(0.245, 0.245) == pytest.approx({0: 32767 / 2, 1: 32767 * 0.49})
    else:
        valves = ItvSerial(ItvSettings(SerialPort("/dev/ttyS0"), SerialPort("/dev/ttyS1")), context).valves
        assert [valve.counts(0.245) for valve in valves if valve] == [512.0, 501.0]


def test_a_monitor_calibrated_in_another_unit_is_refused() -> None:
    calibration = {"monitor_1": {"knots": [[4.0, 0.0], [20.0, 0.5]], "raw_unit": "mA"}}
    with pytest.raises(ConfigError, match="calibrated in 'mA'; allowed for this device: V"):
        ModbusIo(settings(), dataclasses.replace(rigs.context(), calibration=calibration))
