"""What is told of a rig with a channel map, in its own names and units: sentences, table heads, plain data for JSON.

Everything behind the answer works on one range, in MPa and degrees (rig.channels); what leaves the program passes here
once, at the edge. Sentences keep to one form, number and unit, which a test holds (docs/decisions/0911).
For a pneumatic rig everything comes back as it went in.
"""

import math
import re
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Final

from rig.channels import Channels, unit_word

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_BETWEEN = r"(?: to | and | or |, | \.\. | \(|-| +/- )"
_QUANTITY: Final = re.compile(
    rf"(?<![\w.])(?P<numbers>{_NUMBER}(?:{_BETWEEN}{_NUMBER})*\)?)(?P<space>\s?)(?P<unit>deg|kPa|MPa)(?![\w_])"
    rf"(?P<interval> \({_NUMBER} to {_NUMBER}\))?"
)
"""Numbers with their unit behind them, and an interval in brackets behind that: 3 deg (2 to 4)."""
_WORDS: Final = re.compile(r"(?<![\w/.\-])(?P<word>p1 - p2|angle|deg|MPa|kPa|degrees)(?![\w/.\-]\w)")
_PER_UNIT: Final = {"deg": ("output", 1.0), "MPa": ("input", 1.0), "kPa": ("input", 1e-3)}
"""Unit -> the channel that it belongs to, and how much of a working unit it is."""
_AMPLITUDE: Final = re.compile(r"_(\d+\.?\d*)mpa(?=_|$)")
_KEPT: Final = frozenset({"added_to_model", "config", "fingerprint", "file", "log", "model", "path", "source"})
"""Keys whose values are a model file's own numbers, or no sentences."""
_SIZES: Final = frozenset(
    {"value", "low", "high", "from", "to", "std", "before", "after", "per_day", "detectable", "nameable"}
)
_KEY: Final = re.compile(r"_(deg|mpa)(?=_|$)")


def own_text(text: str, channels: Channels) -> str:
    """A sentence, a page or a head of a table in the rig's own names and units; to as many digits as it was told."""
    if channels.has_valves:
        return text
    return _WORDS.sub(partial(_own_word, channels), _QUANTITY.sub(partial(_own_quantity, channels), text))


def own_plain(value: Any, channels: Channels) -> Any:
    """Plain data in the rig's own units: numbers under keys that end in _deg or _mpa, with their keys; sizes beside a
    `unit`; and every text."""
    return value if channels.has_valves else _own_value(value, channels)


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


def _own_quantity(channels: Channels, found: "re.Match[str]") -> str:
    times, unit = factor(found["unit"], channels)
    numbers, interval = (
        re.sub(_NUMBER, lambda number: _scaled(number[0], times), found[part] or "") for part in ("numbers", "interval")
    )
    return f"{numbers}{found['space']}{unit}{interval}"


def _scaled(text: str, times: float) -> str:
    """A number in another unit, with as many significant digits and the same sign written."""
    value, digits = float(text) * times, len(re.sub(r"[eE].*|\D", "", text).lstrip("0")) or 1
    plus = "+" if text.startswith("+") else ""
    if value == 0.0 or not math.isfinite(value):
        return f"{plus}{value:g}"
    last = digits - 1 - math.floor(math.log10(abs(value)))
    return f"{plus}{round(value, last):.{max(last, 0)}f}"


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
        else:
            name, by = _own_key(str(key), channels)
            renamed = name != key and not isinstance(value, Mapping | str)
            out[name] = _times(value, by) if renamed else _own_value(value, channels)
    return out


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
