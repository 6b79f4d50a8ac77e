"""Whatever the numbers: serial commands are understood by the regulator's own parser, registers come back as they
went."""

import math
from collections.abc import Callable

from hypothesis import given
from hypothesis import strategies as st

from drivers.itv_serial.codec import Codec, Dialect, ReplyError
from drivers.modbus_io.codec import decode, encode, to_counts, to_signal
from drivers.modbus_io.maps import ChannelRun, Type, WordOrder
from hil.emulators.itv_serial.regulator import Regulator, RegulatorDialect
from hil.emulators.itv_serial.stand_in import dialect_of
from hil.emulators.modbus.module import ChannelBlock

DIALECTS = st.sampled_from(
    [
        {},
        {"set_command": "P={count}", "monitor_command": "P?", "terminator": "\r"},
        {"set_command": "S{count}", "set_reply": "OK", "echo": True},
        {"set_reply": "", "full_scale_counts": 4095},
    ]
)


@given(raw=DIALECTS, pressure_mpa=st.floats(0.0, 0.5))
def test_driver_and_regulator_understand_each_other(raw: dict[str, object], pressure_mpa: float) -> None:
    dialect = Dialect(**{"reply_terminator": raw.get("terminator", "\r\n"), **raw})
    codec, told = Codec(dialect), []
    speech = dialect_of(raw)
    regulator = Regulator(speech, told.append, lambda: pressure_mpa)
    count = codec.to_count(pressure_mpa / dialect.full_scale_mpa * dialect.full_scale_counts)
    command, end = codec.set(count), dialect.reply_terminator.encode()
    answer = regulator.receive(command).removeprefix(command if dialect.echo else b"")
    assert abs(told[-1] - pressure_mpa) <= 0.5 / dialect.full_scale_counts
    assert bool(answer) == codec.answers_set
    if answer:
        codec.check_set(answer.removesuffix(end), count)
    monitored = regulator.receive(codec.monitor).removeprefix(codec.monitor if dialect.echo else b"")
    assert abs(codec.monitored(monitored.removesuffix(end)) - count) <= 1


@given(st.lists(st.binary(max_size=12), max_size=8))
def test_a_regulator_survives_any_bytes_and_keeps_its_range(pieces: list[bytes]) -> None:
    told: list[float] = []
    regulator = Regulator(RegulatorDialect(), told.append, lambda: 0.1)
    for piece in (*pieces, b"\r\nSET 7\r\n"):
        regulator.receive(piece)
    assert regulator.set_point == 7
    assert all(0.0 <= pressure_mpa <= 0.5 for pressure_mpa in told)


REPLIES = st.one_of(st.binary(max_size=20), st.integers(0, 2000).map(lambda count: b"%d" % count))


@given(REPLIES, st.integers(0, 3).map(lambda steps: 341 * steps))
def test_any_reply_is_confirmed_or_a_reply_error(reply: bytes, count: int) -> None:
    codec = Codec(Dialect())
    confirmed, pressure = (
        _outcome(lambda: codec.check_set(reply, count) or True),
        _outcome(lambda: codec.monitored(reply)),
    )
    if not isinstance(confirmed, str):
        assert int(reply) == count
    assert isinstance(pressure, str) or 0 <= pressure <= 1.1 * 1023
    assert not any("\n" in outcome for outcome in (confirmed, pressure) if isinstance(outcome, str))


def _outcome(parse: Callable[[], int]) -> int | str:
    """What a parser returns, or what its error says."""
    try:
        return parse()
    except ReplyError as error:
        return str(error)


@st.composite
def blocks(draw: st.DrawFn) -> ChannelRun:
    kind = draw(st.sampled_from(Type))
    ranges = {
        Type.UINT16: (0, 65535),
        Type.INT16: (-32768, 32767),
        Type.UINT32: (0, 2**32 - 1),
        Type.INT32: (-(2**31), 2**31 - 1),
    }
    low, high = ranges.get(kind, (-10_000, 10_000))
    first = draw(st.integers(low, high - 1))
    last = draw(st.integers(first + 1, high))
    orders = st.sampled_from(WordOrder)
    return ChannelRun(
        0, 4, (float(first), float(last)), (-10.0, 10.0), type=kind, byte_order=draw(orders), word_order=draw(orders)
    )


@given(blocks(), st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=1, max_size=4))
def test_registers_come_back_rounded_and_inside_the_counts(block: ChannelRun, numbers: list[float]) -> None:
    registers = encode(block, numbers)
    assert len(registers) == len(numbers) * block.type.registers
    assert all(0 <= register <= 0xFFFF for register in registers)
    for number, back in zip(numbers, decode(block, registers), strict=True):
        inside = min(max(number, block.counts[0]), block.counts[1])
        assert block.counts[0] - 1e-3 <= back <= block.counts[1] + 1e-3
        assert abs(back - inside) <= (0.5 if block.type is not Type.FLOAT32 else max(1e-3, abs(inside) * 1e-6))


@given(blocks(), st.floats(-10.0, 10.0))
def test_signal_and_counts_are_inverse_and_the_module_agrees(block: ChannelRun, signal: float) -> None:
    assert math.isclose(to_signal(block, to_counts(block, signal)), signal, rel_tol=1e-6, abs_tol=1e-6)
    table = {"address": 0, "channels": 4, "counts": block.counts, "signal": block.signal, "type": block.type.value,
             "byte_order": block.byte_order.value, "word_order": block.word_order.value}  # fmt: skip
    module = ChannelBlock(table)
    seen = to_signal(block, decode(block, module.put(signal))[0])
    per_count = (block.signal[1] - block.signal[0]) / (block.counts[1] - block.counts[0])
    tolerance = per_count * 0.51 + 1e-3 * (block.type is Type.FLOAT32)
    assert abs(seen - signal) <= tolerance
    assert abs(module.get(encode(block, [to_counts(block, signal)])) - signal) <= tolerance
