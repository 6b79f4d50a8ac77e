"""Registers <-> numbers <-> signals. Pure arithmetic on lists of ints; the bus is elsewhere.

A number (counts) is what the module's converter gives; a signal is what stands on its terminals, in V or mA.
"""

import math
import struct
from collections.abc import Sequence

from drivers.modbus_io.maps import ChannelRun, Type, WordOrder

_CODES = {Type.UINT16: "H", Type.INT16: "h", Type.UINT32: "I", Type.INT32: "i", Type.FLOAT32: "f"}


def encode(block: ChannelRun, numbers: Sequence[float]) -> list[int]:
    """The registers of consecutive channels: rounded (not for floats) and clamped into `block.counts`, so nothing can
    wrap.

    ValueError for a number that is not finite.
    """
    low, high = block.counts
    data = b""
    for number in numbers:
        if not math.isfinite(number):
            raise ValueError(f"{number} cannot be written")
        inside = min(max(number, low), high)
        whole = inside if block.type is Type.FLOAT32 else min(max(round(inside), math.ceil(low)), math.floor(high))
        data += _ordered(struct.pack(">" + _CODES[block.type], whole), block)
    return [int.from_bytes(data[at : at + 2], "big") for at in range(0, len(data), 2)]


def decode(block: ChannelRun, registers: Sequence[int]) -> list[float]:
    """The numbers of consecutive channels; a float32 that is not finite stays so and is NaN's business of the
    caller."""
    size = 2 * block.type.registers
    data = b"".join(register.to_bytes(2, "big") for register in registers)
    if len(data) % size:
        raise ValueError(f"{len(registers)} registers do not hold whole {block.type.value} channels")
    return [
        float(struct.unpack(">" + _CODES[block.type], _ordered(data[at : at + size], block))[0])
        for at in range(0, len(data), size)
    ]


def _ordered(data: bytes, block: ChannelRun) -> bytes:
    """Swap to or from the module's order; its own inverse."""
    words = [data[at : at + 2] for at in range(0, len(data), 2)]
    if block.word_order is WordOrder.LITTLE:
        words.reverse()
    if block.byte_order is WordOrder.LITTLE:
        words = [word[::-1] for word in words]
    return b"".join(words)


def to_signal(block: ChannelRun, number: float) -> float:
    """Counts -> V or mA, on the straight line of the map."""
    (c0, c1), (s0, s1) = block.counts, block.signal
    return s0 + (number - c0) * (s1 - s0) / (c1 - c0)


def to_counts(block: ChannelRun, signal: float) -> float:
    """V or mA -> counts, not yet rounded or clamped."""
    (c0, c1), (s0, s1) = block.counts, block.signal
    return c0 + (signal - s0) * (c1 - c0) / (s1 - s0)


def rtu_exchange_s(baud: int, bits_per_byte: int, sent_bytes: int, answered_bytes: int) -> float:
    """Wire time of one RTU request and its reply, with a silence of 3.5 characters after each of them (1.75 ms above
    19200 baud).

    Modbus over serial line V1.02, 2.5.1.1. C: the module's own time comes on top.
    """
    return (sent_bytes + answered_bytes) * bits_per_byte / baud + 2 * rtu_silence_s(baud, bits_per_byte)


def rtu_silence_s(baud: int, bits_per_byte: int) -> float:
    """What parts two RTU frames, and by which a receiver knows the end of one."""
    return 0.00175 if baud > 19200 else 3.5 * bits_per_byte / baud
