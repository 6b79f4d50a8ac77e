"""What the input and the output of a rig are: their names, their units, and their place on the working range.

A pneumatic rig is driven by the differential pressure (MPa) and answers with an angle (deg). Another rig, a motor with
a set-point in mm, says so by a channel map. Models, priors and effects work on one range whatever the rig: the middle
of a channel's stated range is 0, its ends are 0.2 MPa or 20 deg away (docs/decisions/0910). Records hold the working
values in `dp_cmd_mpa` and `angle_deg`; this module leads there and back.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from rig.config import structure
from rig.errors import ConfigError, RecordError

FACT: Final = "channels"
"""The run fact that holds a channel map."""
EFFECTS_FACT: Final = "possible_effects"
"""The run fact that holds the effects, or the stages of the chain, that a rig can have."""
INPUT_HALF_MPA: Final = 0.2
"""Working value at the end of the input's range: what the paper's sweeps reach."""
OUTPUT_HALF_DEG: Final = 20.0
"""Working value at the end of the output's range: what the paper's joint turns by."""
REST_MPA: Final = 0.2
"""Mean pressure that stands for a rig without pressures on the working range: the paper's."""
BEYOND: Final = 2.0
"""Values further from the middle than this many halves of the range are in another unit."""
LONGEST_NAME: Final = 40
"""Of a channel, and of its unit."""


@dataclass(frozen=True)
class Channel:
    """One signal of the rig. Columns are numpy arrays or floats alike."""

    name: str
    unit: str
    range: tuple[float, float]
    """What it usually moves in, in its unit: the same for every record of the rig, or they cannot be compared."""

    @property
    def middle(self) -> float:
        """Middle of the range."""
        return 0.5 * (self.range[0] + self.range[1])

    @property
    def half(self) -> float:
        """Half of the range's width."""
        return 0.5 * (self.range[1] - self.range[0])

    @property
    def spoken(self) -> str:
        """Its name in a sentence: set point."""
        return self.name.replace("_", " ")

    @property
    def column(self) -> str:
        """Its name with the unit in it, as columns are called: position_mm."""
        return f"{self.name}_{unit_word(self.unit)}"


@dataclass(frozen=True)
class Channels:
    """Input and output of a rig."""

    input: Channel
    output: Channel

    @property
    def has_valves(self) -> bool:
        """The input is a differential pressure that two regulators make; without valves none of their effects is
        offered."""
        return self == PNEUMATIC

    @property
    def input_per_mpa(self) -> float:
        """Own units of the input for one working MPa."""
        return self.input.half / INPUT_HALF_MPA

    @property
    def output_per_deg(self) -> float:
        """Own units of the output for one working degree."""
        return self.output.half / OUTPUT_HALF_DEG

    def working_input(self, own: Any) -> Any:
        """Values of the input on the working range (MPa)."""
        return own if self.has_valves else (own - self.input.middle) / self.input_per_mpa

    def working_output(self, own: Any) -> Any:
        """Values of the output on the working range (deg)."""
        return own if self.has_valves else (own - self.output.middle) / self.output_per_deg

    def own_input(self, dp_mpa: Any) -> Any:
        """Working values of the input in its own unit."""
        return dp_mpa if self.has_valves else self.input.middle + self.input_per_mpa * dp_mpa

    def own_output(self, angle_deg: Any) -> Any:
        """Working values of the output in its own unit."""
        return angle_deg if self.has_valves else self.output.middle + self.output_per_deg * angle_deg

    def plain(self) -> dict[str, Any]:
        """As facts and YAML hold it."""
        return {
            slot: {"name": one.name, "unit": one.unit, "range": list(one.range)}
            for slot, one in (("input", self.input), ("output", self.output))
        }


PNEUMATIC: Final = Channels(
    Channel("p1 - p2", "MPa", (-INPUT_HALF_MPA, INPUT_HALF_MPA)),
    Channel("angle", "deg", (-OUTPUT_HALF_DEG, OUTPUT_HALF_DEG)),
)
"""The rig of the paper: working values are its own."""


def unit_word(unit: str) -> str:
    """A unit as it stands in a column's name: mm, n_m, percent."""
    word = unit.replace("%", "percent").replace("\N{DEGREE SIGN}", "deg").replace("\N{MICRO SIGN}", "u")
    return "".join(letter if letter.isalnum() else "_" for letter in word.lower()).strip("_") or "1"


def check_channels(channels: Channels, where: str) -> Channels:
    """The channel map itself; ConfigError when a name, a unit or a range cannot be one."""
    for slot, one in (("input", channels.input), ("output", channels.output)):
        if not one.name.isidentifier() or len(one.name) > LONGEST_NAME:
            raise ConfigError(
                f"{where}: {slot}.name: {one.name[:LONGEST_NAME]!r} is no name; letters, digits and _ are allowed, "
                f"at most {LONGEST_NAME}"
            )
        if not one.unit.strip() or len(one.unit) > LONGEST_NAME or not one.unit.isprintable():
            shown = one.unit[:LONGEST_NAME]
            raise ConfigError(f"{where}: {slot}.unit: {shown!r} is no unit; write '1' where there is none")
        if not one.half > 0.0 or not math.isfinite(one.half):
            low, high = one.range
            raise ConfigError(
                f"{where}: {slot}.range: {low:g} .. {high:g} is empty; the first value must be the smaller one"
            )
    if channels.input.column == channels.output.column:
        raise ConfigError(f"{where}: input and output are both called {channels.input.column}; they must differ")
    return channels


def channels_of(facts: Mapping[str, Any], where: str) -> Channels:
    """The channel map that facts hold, the pneumatic rig's where they hold none; RecordError when it is none."""
    raw = facts.get(FACT)
    if raw is None:
        return PNEUMATIC
    try:
        return check_channels(structure(raw, Channels, f"{where}: channels"), f"{where}: channels")
    except ConfigError as error:
        raise RecordError(str(error)) from None


def common(maps: "list[tuple[str, Channels]]") -> Channels:
    """The one channel map that all share, by the names of what they belong to; RecordError when two differ."""
    for name, one in maps[1:]:
        if one != maps[0][1]:
            raise RecordError(
                f"{name}: {map_text(one)}; {maps[0][0]}: {map_text(maps[0][1])}; they are of different rigs"
            )
    return maps[0][1] if maps else PNEUMATIC


def map_text(channels: Channels) -> str:
    """A channel map in a message."""
    one, other = channels.input, channels.output
    return (
        f"{one.name} in {one.unit} ({one.range[0]:g} to {one.range[1]:g}) to "
        f"{other.name} in {other.unit} ({other.range[0]:g} to {other.range[1]:g})"
    )
