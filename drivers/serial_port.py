"""A serial port and its framing, as a rig's YAML names it."""

import os
from dataclasses import dataclass

from rig.fields import bounded


@dataclass(frozen=True)
class SerialPort:
    """RS-232C joins two ends: each valve has a port of its own. RS-485 joins many: a bus has one port."""

    device: str
    """/dev/ttyUSB0, or a URL that pyserial knows, such as socket://host:port."""
    baud: int = bounded(300, 4_000_000, "baud", default=9600)
    parity: str = "N"
    stop_bits: int = bounded(1, 2, "bit", default=1)
    data_bits: int = bounded(7, 8, "bit", default=8)

    def __post_init__(self) -> None:
        if self.parity not in ("N", "E", "O"):
            raise ValueError(f"parity {self.parity!r} is unknown; allowed: N, E, O")

    @property
    def wires(self) -> tuple[str, ...]:
        """The port, whichever of its links it is called by, and that link: a plug that is put back may be another port
        behind the same link, and who held it before is still to be found."""
        return (self.device,) if "://" in self.device else (*{self.device: 0, os.path.realpath(self.device): 0},)

    @property
    def bits_per_byte(self) -> int:
        """Start, data, parity and stop bits."""
        return 1 + self.data_bits + (self.parity != "N") + self.stop_bits
