"""Counts and volts of the myRIO-1900's analog terminals. Arithmetic only; nothing is read or written here.

Connectors A and B: 0-5 V, 12 bits, unsigned. Connector C: +-10 V, 12 bits, signed; its register may be declared U16,
which then carries the two's complement (-1000 reads as 64536), or I16. Weights as in NI's myRIO C support (WGHT, in
nV).
"""

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

VOLTS_A_B: Final = 1_220_703e-9
"""V a count of the converters at connectors A and B: 0 to 5 V by 12 bits."""
VOLTS_C: Final = 4_882_813e-9
"""V a count of the converter at connector C: -10 to 10 V by 12 bits."""
_NAME = re.compile(r"(AI|AO)\.([ABC])_([0-3])\.VAL")


@dataclass(frozen=True)
class Converter:
    """One analog terminal: volts = lsb_v * counts."""

    lsb_v: float
    low_counts: int
    high_counts: int

    @property
    def low_v(self) -> float:
        """The lowest voltage it can read or give."""
        return self.lsb_v * self.low_counts

    @property
    def high_v(self) -> float:
        """The highest voltage it can read or give."""
        return self.lsb_v * self.high_counts


UNIPOLAR: Final = Converter(VOLTS_A_B, 0, 4095)
BIPOLAR: Final = Converter(VOLTS_C, -2048, 2047)


def converter(register: str, output: bool) -> Converter:
    """The converter behind a register by its name in the bitfile, AI.A_0.VAL or AO.C_1.VAL; ValueError for any other
    name."""
    match = _NAME.fullmatch(register)
    if (
        match is None
        or match[1] != ("AO" if output else "AI")
        or int(match[3]) > (1 if output or match[2] == "C" else 3)
    ):
        kind = "AO.A_0.VAL .. AO.C_1.VAL" if output else "AI.A_0.VAL .. AI.B_3.VAL, AI.C_0.VAL, AI.C_1.VAL"
        raise ValueError(
            f"{register!r} is not an analog {'output' if output else 'input'} of the myRIO; allowed: {kind}"
        )
    return BIPOLAR if match[2] == "C" else UNIPOLAR


def decoder(terminal: Converter, datatype: str, units_per_volt: float = 1.0) -> Callable[[int], float]:
    """What turns a register's value into the signal at the terminal; made once, called each tick.

    `datatype` as the bitfile declares the register; ValueError for other types than U16 and I16.
    """
    scale = terminal.lsb_v * units_per_volt
    if _wrap(datatype) and terminal.low_counts < 0:
        return lambda raw: (raw - 0x10000 if raw & 0x8000 else raw) * scale
    return lambda raw: raw * scale


@dataclass(frozen=True, slots=True)
class Encoder:
    """Signal -> value of a register, rounded and clamped to the counts between two ends of the signal."""

    counts_per_unit: float
    low: int
    high: int
    wrap: int
    """Added to negative counts: 65536 for two's complement in a U16."""

    def __call__(self, signal: float) -> int:
        """The register's value for a finite signal."""
        counts = round(signal * self.counts_per_unit)
        if not self.low <= counts <= self.high:
            counts = min(max(counts, self.low), self.high)
        return counts if counts >= 0 else counts + self.wrap


def encoder(terminal: Converter, datatype: str, low: float, high: float, units_per_volt: float = 1.0) -> Encoder:
    """The encoder for a signal between `low` and `high`, which no rounding leaves; ValueError for a type other than
    U16, I16."""
    scale = terminal.lsb_v * units_per_volt
    least = max(math.ceil(low / scale - 1e-9), terminal.low_counts)
    most = min(math.floor(high / scale + 1e-9), terminal.high_counts)
    return Encoder(1.0 / scale, least, most, _wrap(datatype))


def _wrap(datatype: str) -> int:
    if datatype not in ("U16", "I16"):
        raise ValueError(f"a data type of {datatype}, expected U16 or I16")
    return 0x10000 if datatype == "U16" else 0
