"""What the data sheets of the paper's parts allow: sizes beside which a detectable one is read."""

from dataclasses import dataclass
from typing import Final

ITV_SPAN_MPA: Final = 0.5
WDD35D8_SPAN_DEG: Final = 345.0


@dataclass(frozen=True)
class Allowed:
    """A figure of a data sheet, in the unit of the effect's size."""

    size: float
    what: str


ALLOWED: Final[dict[str, Allowed]] = {
    "valve_gain": Allowed(0.01, "SMC ITV: linearity 1 % of full scale"),
    "valve_offset": Allowed(0.005 * ITV_SPAN_MPA, "SMC ITV: repeatability 0.5 % of full scale"),
    "co_contraction": Allowed(0.005 * ITV_SPAN_MPA, "SMC ITV: repeatability 0.5 % of full scale"),
    "valve_dead_band": Allowed(0.002 * ITV_SPAN_MPA, "SMC ITV: sensitivity 0.2 % of full scale"),
    "quantisation": Allowed(
        WDD35D8_SPAN_DEG / 2**12, "myRIO, connectors A and B: 12 bits over the potentiometer's span"
    ),
    "sensor_nonlinearity": Allowed(0.01, "WDD35D8: linearity 1 %, the widest grade"),
}
"""Only where a data sheet says something of that very effect (docs/reference/devices.md)."""
