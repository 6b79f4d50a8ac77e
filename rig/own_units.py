"""What is told of a rig with a channel map, in its own names and units: sentences, table heads, plain data for JSON.

Everything behind the answer works on one range, in MPa and degrees (rig.channels); what leaves the program passes here
once, at the edge. Sentences keep to one form, number and unit, which a test holds (docs/decisions/0911).
For a pneumatic rig everything comes back as it went in.
"""

import math
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from typing import Any, Final

from rig.channels import Channels, unit_word
from rig.errors import RigError

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_BETWEEN = r"(?: to | and | or |, | \.\. | \(|-| +/- )"
_QUANTITY: Final = re.compile(
    rf"(?P<reads>\breads? )?(?<![\w.])(?P<numbers>{_NUMBER}(?:{_BETWEEN}{_NUMBER})*\)?)"
    rf"(?P<space>\s?)(?P<unit>deg|kPa|MPa)(?![\w_])"
    rf"(?P<interval> \({_NUMBER} to {_NUMBER}\))?"
)
"""Numbers with their unit behind them, and an interval in brackets behind that: 3 deg (2 to 4). What a channel reads is
a place on its scale, whose zero is the rig's own: reads 3 deg."""
_WORDS: Final = re.compile(r"(?<![\w/.\-])(?P<word>p1 - p2|angle|deg|MPa|kPa|degrees)(?![\w/.\-]\w)")
_PER_UNIT: Final = {"deg": ("output", 1.0), "MPa": ("input", 1.0), "kPa": ("input", 1e-3)}
"""Unit -> the channel that it belongs to, and how much of a working unit it is."""
_AMPLITUDE: Final = re.compile(r"_(\d+\.?\d*)mpa(?=_|$)")
_KEPT: Final = frozenset({"added_to_model", "config", "fingerprint", "file", "log", "model", "path", "source"})
"""Keys whose values are a model file's own numbers, or no sentences."""
_SIZES: Final = frozenset(
    {"value", "low", "high", "from", "to", "std", "before", "after", "per_day", "detectable", "nameable"}
)
_PLACES: Final = frozenset({"high_deg", "low_deg", "rail_deg"})
"""Keys of sizes that are places on the output's scale, not differences."""
_KEY: Final = re.compile(r"_(deg|mpa)(?=_|$)")


def own_text(text: str, channels: Channels) -> str:
    """A sentence, a page or a head of a table in the rig's own names and units; to as many digits as it was told."""
    if channels.has_valves:
        return text
    return _WORDS.sub(partial(_own_word, channels), _QUANTITY.sub(partial(_own_quantity, channels), text))


@contextmanager
def telling(channels: Channels) -> Iterator[None]:
    """What is refused inside is refused in the rig's own names and units."""
    try:
        yield
    except RigError as error:
        error.args = (own_text(str(error), channels),)
        raise


def own_plain(value: Any, channels: Channels) -> Any:
    """Plain data in the rig's own units: numbers under keys that end in _deg or _mpa, with their keys; sizes beside a
    `unit`; and every text."""
    return value if channels.has_valves else _own_value(value, channels)


def own_places(text: str, channels: Channels) -> str:
    """A text whose quantities are all places on a channel's scale, as the bands of an angle are: -20 to -10 deg."""
    if channels.has_valves:
        return text
    return _WORDS.sub(partial(_own_word, channels), _QUANTITY.sub(partial(_own_quantity, channels, place=True), text))


def own_label(label: str, channels: Channels) -> str:
    """The short name of an excitation with its amplitude in the rig's own unit: sine_0.5hz_40mm. No name of a file:
    those stay as they were written."""
    if channels.has_valves:
        return label
    unit, times = unit_word(channels.input.unit), channels.input_per_mpa
    return _AMPLITUDE.sub(lambda found: f"_{times * float(found[1]):.4g}{unit}", label)


def factor(unit: str, channels: Channels) -> tuple[float, str]:
    """What a number in `unit` (deg/min, MPa/s) is times in the rig's own unit, and that unit."""
    head, slash, rest = unit.partition("/")
    if channels.has_valves or head not in _PER_UNIT:
        return 1.0, unit
    slot, share = _PER_UNIT[head]
    return share * _scale(channels, slot), f"{getattr(channels, slot).unit}{slash}{rest}"


def _scale(channels: Channels, slot: str) -> float:
    return channels.input_per_mpa if slot == "input" else channels.output_per_deg


def _own_quantity(channels: Channels, found: "re.Match[str]", place: bool = False) -> str:
    times, unit = factor(found["unit"], channels)
    from_zero = _middle(found["unit"], channels) if place or found["reads"] else 0.0
    numbers, interval = (
        re.sub(_NUMBER, lambda number: _scaled(number[0], times, from_zero), found[part] or "")
        for part in ("numbers", "interval")
    )
    return f"{found['reads'] or ''}{numbers}{found['space']}{unit}{interval}"


def _middle(unit: str, channels: Channels) -> float:
    """What the channel of a working unit reads where the working value is 0, in the rig's own unit."""
    slot, _ = _PER_UNIT[unit]
    return (channels.input if slot == "input" else channels.output).middle


def _scaled(text: str, times: float, from_zero: float = 0.0) -> str:
    """A number in another unit, with as many significant digits and the same sign written; as many decimals where the
    other scale has another zero."""
    value, digits = float(text) * times, len(re.sub(r"[eE].*|\D", "", text).lstrip("0")) or 1
    plus = "+" if text.startswith("+") else ""
    if not math.isfinite(value) or (value == 0.0 and from_zero == 0.0):
        return f"{plus}{value:g}"
    last = digits - 1 - math.floor(math.log10(abs(value or times)))
    return f"{plus}{round(value + from_zero, last):.{max(last, 0)}f}"


def _own_word(channels: Channels, found: "re.Match[str]") -> str:
    word = found["word"]
    if word in ("deg", "degrees"):
        return channels.output.unit
    if word in ("MPa", "kPa"):
        return channels.input.unit
    return (channels.output if word == "angle" else channels.input).spoken


def _own_value(value: Any, channels: Channels) -> Any:
    if isinstance(value, str):
        return own_text(value, channels)
    if isinstance(value, Mapping):
        return _own_mapping(value, channels)
    return [_own_value(item, channels) for item in value] if isinstance(value, list | tuple) else value


def _own_mapping(raw: Mapping[str, Any], channels: Channels) -> dict[str, Any]:
    times, unit = factor(str(raw.get("unit", "")), channels)
    out: dict[str, Any] = {}
    for key, value in raw.items():
        if key in _KEPT:
            out[key] = value
        elif key == "unit":
            out[key] = unit
        elif key in _SIZES and _is_number(value):
            out[key] = times * value
        elif key in _PLACES and isinstance(value, Mapping):
            out[_own_key(str(key), channels)[0]] = _own_place(value, channels)
        elif key == "angle" and isinstance(value, str):  # a band of it
            out[key] = own_places(value, channels)
        else:
            name, by = _own_key(str(key), channels)
            renamed = name != key and not isinstance(value, Mapping | str)
            out[name] = _times(value, by) if renamed else _own_value(value, channels)
    return out


def _own_place(size: Mapping[str, Any], channels: Channels) -> dict[str, Any]:
    """A size that is a place on the output's scale."""
    own = {key: channels.own_output(value) for key, value in size.items() if key in _SIZES and _is_number(value)}
    return {**_own_mapping(size, channels), **own}


def _own_key(key: str, channels: Channels) -> tuple[str, float]:
    """A key in its own unit, and what its numbers are times there."""
    found = _KEY.search(key)
    if found is None:
        return key, 1.0
    slot = "output" if found[1] == "deg" else "input"
    unit = unit_word(getattr(channels, slot).unit)
    return f"{key[: found.start()]}_{unit}{key[found.end() :]}", _scale(channels, slot)


def _times(value: Any, by: float) -> Any:
    """Numbers times a factor, however deep the lists."""
    if _is_number(value):
        return by * value
    if isinstance(value, list | tuple):
        return [_times(item, by) for item in value]
    return value


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def speaker(channels: Channels) -> Callable[[str], str]:
    """`own_text` for one rig."""
    return partial(own_text, channels=channels)
