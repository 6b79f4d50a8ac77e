"""A proposed mapping for a table that nobody has described: by names, units in names, sizes, and what follows what.

It is a proposal: every entry says what it rests on, and what was only likely is said as a doubt. Nothing is imported by
it, but by what it proposes the table can be.
"""

import itertools
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from rig.channels import LONGEST_NAME, Channel
from rig.columns import correlation
from rig.errors import RecordError
from rig.further_channels import PLACES, RESERVED
from rig.log.foreign.delimited import Style, read_lines, text_table
from rig.log.foreign.kinds import FileKind, kind_of
from rig.log.foreign.sniff import sniff
from rig.log.foreign.stamps import FORMS
from rig.log.foreign.tables import RawColumn, RawTable, raw_delimited, read_tdms
from rig.log.foreign.units import PRESSURE_SIZES, STEP_SIZES, UNITS, converted, unit_by_size
from rig.log.mcap.columns import Array
from rig.number_text import counted
from rig.sample import WIRES

_TIME: Final = ("t", "time", "zeit", "temps", "timestamp", "stamp", "log_time", "seconds", "ms")
_COMMAND: Final = (
    "cmd", "command", "soll", "sollwert", "set", "setpoint", "ref", "reference", "goal", "target", "u", "desired",
    "consigne", "sp", "des",
)  # fmt: skip
_MEASURED: Final = (
    "meas", "measured", "ist", "istwert", "act", "actual", "monitor", "mon", "y", "feedback", "mesure", "pv",
)  # fmt: skip
_ANGLE: Final = ("angle", "winkel", "theta", "phi", "encoder", "pot", "deg", "rad")
_PRESSURE: Final = ("p", "p1", "p2", "dp", "pressure", "druck", "pression", "mpa", "kpa", "bar", "psi")
_GLUED: Final = {
    "".join(pair): pair
    for one in ("p", "dp", "press", "pressure", "druck")
    for role in (*_COMMAND, *_MEASURED)
    if len(role) > 1
    for pair in ((one, role), (role, one))
}
"""Words that are written without anything between them: `pset`, `solldruck`."""
_DIFFERENCE: Final = ("dp", "delta", "diff", "difference", "differenz")
_FIRST: Final = ("1", "p1", "a", "left", "l", "df", "flex", "agonist")
_SECOND: Final = ("2", "p2", "b", "right", "r", "f", "ext", "antagonist")
_MOST_RADIANS: Final = 3.3
"""An angle without a unit that stays below this is in radians: half a turn and a little. A joint that moves by less
than 3.3 deg and says no unit is taken for one in radians, which the proposal says."""
_AGAINST: Final = -0.7
"""Correlation from which on two columns run against each other (`rig.identify.records.mix_ups.OPPOSED`)."""
_USUAL_PERIODS_S: Final = (1e-4, 0.5)
"""Between these lies the period of a log whose unit of time is believed without a word: 10 kHz are more than any of the
devices gives, 2 Hz less than shows a muscle. Outside only a doubt is said."""
_NEARLY_SYMMETRIC: Final = 0.5
"""A range whose shorter side of 0 reaches this share of the longer one is proposed symmetric, as a converter's is."""
_UNIT_WORDS: Final = {unit.lower(): unit for unit in UNITS if unit not in ("in", "m", "A", "V", "N")} | {
    "n": "N", "v": "V", "in": "in", "m": "m", "sec": "s", "grad": "deg", "rads": "rad",
}  # fmt: skip
OTHER: Final = "something else"
"""What a unit measures that we do not know."""


@dataclass
class Guess:
    """A proposal."""

    mapping: dict[str, Any] = field(default_factory=dict)
    """As the YAML of `pamrig log import --mapping`."""
    meaning: list[str] = field(default_factory=list)
    """What it would mean, a line an entry, with what it rests on."""
    doubts: list[str] = field(default_factory=list)
    """What somebody who knows the rig should look at first."""


@dataclass(frozen=True)
class _Seen:
    """One column as it was found."""

    name: str
    values: Array
    words: tuple[str, ...]
    unit: str | None
    """That the file states, known to us or not, or else its name."""
    stated: bool = False

    @property
    def quantity(self) -> str | None:
        """What its unit measures; None without a unit."""
        return None if self.unit is None else UNITS[self.unit].quantity if self.unit in UNITS else OTHER

    def has(self, words: Sequence[str]) -> bool:
        return any(word in words for word in self.words)


def guess(path: Path) -> Guess:
    """A mapping for the CSV or TDMS at `path`; RecordError when it holds no table of numbers, or nothing like a time
    and two signals."""
    found = Guess()
    seen = [_seen(name, column) for name, column in _table(path, found).columns.items()]
    time = _time(seen, found, path)
    other_times = [one.name for one in seen if one is not time and _is_stamped(one)]
    if other_times:
        found.meaning.append(f"not imported, as they are further times: {', '.join(map(repr, other_times))}")
    known = [one for one in seen if one is not time and one.name not in other_times and np.isfinite(one.values).any()]
    rest = [one for one in known if np.ptp(_known(one)) > 0.0]
    if len(rest) < 2:
        move = counted(len(rest), "column beside the time moves", "columns beside the time move")
        raise RecordError(f"{path}: {move}; a command and an answer are needed")
    commands, angle, pressures = _roles(rest)
    still = [one for one in known if one not in rest]
    if len(commands) == 1:
        commands += [one for one in _roles(still)[0] if {_side(one), _side(commands[0])} == {1, 2}]
    if angle is not None and (commands or pressures):
        _pneumatic(found, commands, angle, pressures)
    else:
        _one_in_one_out(found, rest)
    _further(found, [*rest, *still])  # what stands still may be a condition
    return found


def _table(path: Path, found: Guess) -> RawTable:
    kind = kind_of(path)
    if kind is FileKind.TDMS:
        return read_tdms(path)
    if kind is FileKind.MCAP:
        raise RecordError(f"{path}: a mapping for MCAP is not guessed; `pamrig log info` lists its channels")
    lines = read_lines(path)
    style = sniff(path, lines)
    usual = Style()
    for key in ("separator", "decimal", "skip_rows", "units_row"):
        if getattr(style, key) != getattr(usual, key):
            found.mapping[key] = getattr(style, key)
    text = text_table(path, lines, style)
    numeric = text.numeric()
    table = raw_delimited(text, wanted=numeric)
    if worded := [repr(name) for name in table.columns if name not in numeric]:
        found.meaning.append(f"not imported, as they hold text: {', '.join(worded)}")
    return replace(table, columns={name: table.columns[name] for name in numeric})


def _seen(name: str, column: RawColumn) -> _Seen:
    plain = name.rpartition("/")[2]
    words = tuple(word for word in re.split(r"[^0-9a-z%\u00b0\u00b5]+", plain.lower()) if word)
    split = tuple(part for word in words for part in re.findall(r"[a-z]+|\d+", word) if part != word)
    split += tuple(part for word in (*words, *split) for part in _GLUED.get(word, ()))
    unit = column.unit or next((_UNIT_WORDS[word] for word in reversed(words[1:]) if word in _UNIT_WORDS), None)
    return _Seen(name, column.values, words + split, unit, column.unit is not None)


def _known(one: _Seen) -> Array:
    return one.values[np.isfinite(one.values)]


def _is_stamped(one: _Seen) -> bool:
    """Whether the file itself says that this is a time, and it goes on."""
    return one.stated and one.quantity == "time" and bool(np.ptp(one.values) > 0.0 and (np.diff(one.values) >= 0).all())


def _time(seen: Sequence[_Seen], found: Guess, path: Path) -> _Seen:
    possible = [one for one in seen if one.quantity in (None, "time") or (one.has(_TIME) and not one.stated)]
    rising = [one for one in possible if np.isfinite(one.values).all() and (np.diff(one.values) > 0).all()]
    if not rising:
        raise RecordError(
            f"{path}: no column of numbers rises from row to row as a time does, nor one of time stamps ({FORMS}); for "
            "rows that are evenly apart a mapping says it: `period_s: 0.005`"
        )
    named = [one for one in rising if one.has(_TIME)]
    time = (named or rising)[0]
    step = float(np.median(np.diff(time.values)))
    stated = time.unit if time.quantity == "time" else None
    unit = stated or unit_by_size(step, STEP_SIZES)
    period_s = step * UNITS[unit].times / UNITS[unit].by
    found.mapping["columns"] = {"t_s": {"source": time.name, "unit": unit}}
    why = "the file says" if time.stated else "its name says" if stated else f"its rows are {step:.4g} apart"
    found.meaning.append(
        f"time: {time.name!r} in {unit} ({why}): {len(time.values)} rows every {1e3 * period_s:.4g} ms"
    )
    if not named and not time.stated:
        found.doubts.append(f"{time.name!r} is taken for the time because it rises from row to row")
    if stated and not _USUAL_PERIODS_S[0] < period_s < _USUAL_PERIODS_S[1]:
        found.doubts.append(f"a row every {period_s:.4g} s is unusual; is {time.name!r} really in {unit}?")
    return time


def _roles(rest: Sequence[_Seen]) -> tuple[list[_Seen], _Seen | None, list[_Seen]]:
    """Commanded pressures, the angle, measured pressures."""
    angles = [one for one in rest if one.has(_ANGLE) or one.quantity == "angle"]
    angles = [one for one in angles if one.quantity in (None, "angle") and not one.has(_COMMAND)]
    pressures = [one for one in rest if one.has(_PRESSURE) or one.quantity == "pressure"]
    pressures = [one for one in pressures if one not in angles and one.quantity in (None, "pressure")]
    commands = [one for one in pressures if one.has(_COMMAND) and not one.has(_MEASURED)]
    measured = [one for one in pressures if one not in commands]
    if not commands:  # a set-point without a word for pressure
        commands = [one for one in rest if one.has(_COMMAND) and one.quantity is None and one not in angles]
    return commands, angles[0] if len(angles) == 1 else None, measured


def _pneumatic(found: Guess, commands: list[_Seen], angle: _Seen, measured: list[_Seen]) -> None:
    if not commands:
        names = " and ".join(repr(one.name) for one in measured[:2])
        found.doubts.append(f"no set-point was found; {names} stand for what was commanded")
    taken = commands or measured[:2]
    if len(taken) >= 2:
        first, second = _sides(taken, found, "commands")
        _add(found, "p1_cmd_mpa", first, _pressure_unit(first))
        _add(found, "p2_cmd_mpa", second, _pressure_unit(second))
        command = first.values - second.values
    else:
        command = _single_command(found, taken[0], measured if commands else [])
    if len(measured) >= 2:
        first, second = _sides(measured, found, "measured pressures")
        first, second = _unswapped(first, second, command, found)
        _add(found, "p1_mpa", first, _pressure_unit(first))
        _add(found, "p2_mpa", second, _pressure_unit(second))
    largest = float(np.max(np.abs(_known(angle))))
    unit = angle.unit or ("rad" if largest <= _MOST_RADIANS else "deg")
    _add(found, "angle_deg", angle, (unit, "its name says" if angle.unit else f"its largest value is {largest:.3g}"))
    if unit == "rad" and not angle.unit:
        found.doubts.append(
            f"{angle.name!r} is taken for radians because it stays within {largest:.3g}; is it in degrees?"
        )
    _say_sign(found, angle, command)


def _single_command(found: Guess, one: _Seen, measured: Sequence[_Seen]) -> Array:
    """The only commanded pressure, as p1 - p2 or as the set-point of one muscle; what it does to p1 - p2."""
    side = _side_beside(one, measured)
    if side == 0:
        _add(found, "dp_cmd_mpa", one, _pressure_unit(one))
        if np.min(_known(one)) > 0.0:
            found.doubts.append(
                f"{one.name!r} is taken for the commanded p1 - p2 and is never negative; is it the set-point of one "
                "muscle (p1_cmd_mpa or p2_cmd_mpa)?"
            )
        return one.values
    _add(found, f"p{side}_cmd_mpa", one, _pressure_unit(one))
    _add_other_muscle(found, one, 3 - side, measured)
    return one.values if side == 1 else -one.values


def _add_other_muscle(found: Guess, one: _Seen, side: int, measured: Sequence[_Seen]) -> None:
    """The set-point of muscle `side`, of which the table has none: as its measured pressure shows it, else about P0."""
    name, unit = f"p{side}_cmd_mpa", _pressure_unit(one)[0]
    scale, about, why = -1.0, float(_known(one).min() + _known(one).max()), "as usual; nothing here shows it"
    if len(measured) >= 2:
        other = _sides(measured, Guess(), "")[side - 1]
        theirs = converted(other.values, _pressure_unit(other)[0], unit, other.name)
        scale = -1.0 if correlation(theirs, one.values) < _AGAINST else 0.0
        about, why = float(np.nanmedian(theirs - scale * one.values)), f"as {other.name!r} does"
    offset = float(f"{about:.4g}")
    found.mapping["columns"][name] = {"source": one.name, "unit": unit, "scale": scale, "offset": offset}
    moves = f"goes against it about {offset / 2:.4g} {unit}" if scale else f"rests at {offset:.4g} {unit}"
    found.doubts.append(
        f"{one.name!r} is the set-point of muscle {3 - side} and there is none of the other: {name} {moves} ({why}); "
        "`scale: -1` with 2 P0 as the `offset` is about P0, `scale: 0` at rest"
    )


def _side(one: _Seen) -> int:
    """The muscle that a name says, 1 or 2; 0 where it says none, or both."""
    return {(True, False): 1, (False, True): 2}.get((one.has(_FIRST), one.has(_SECOND)), 0)


def _side_beside(one: _Seen, measured: Sequence[_Seen]) -> int:
    """Whose set-point a single command is: 1 or 2 by its name, or by the measured pressure that it lies nearest to; 0
    for p1 - p2."""
    if one.has(_DIFFERENCE) or np.min(_known(one)) < 0.0:
        return 0
    if len(measured) < 2 or _side(one):
        return _side(one)
    first, second = _sides(measured, Guess(), "")
    p1, p2 = _in_mpa(first), _in_mpa(second)
    off = [float(np.nanmedian(np.abs(_in_mpa(one) - each))) for each in (p1 - p2, p1, p2)]
    return int(np.argmin(off))


def _in_mpa(one: _Seen) -> Array:
    unit = UNITS[_pressure_unit(one)[0]]
    return one.values * unit.times / unit.by


def _sides(pair: Sequence[_Seen], found: Guess, what: str) -> tuple[_Seen, _Seen]:
    first = next((one for one in pair if one.has(_FIRST)), None)
    second = next((one for one in pair if one.has(_SECOND) and one is not first), None)
    if first is None or second is None:
        found.doubts.append(f"{what}: {pair[0].name!r} is taken for muscle 1 because it comes first")
        return pair[0], pair[1]
    return first, second


def _unswapped(first: _Seen, second: _Seen, command: Array, found: Guess) -> tuple[_Seen, _Seen]:
    if correlation(first.values - second.values, command) > _AGAINST:
        return first, second
    found.doubts.append(
        f"{first.name!r} - {second.name!r} runs against the command: they are taken the other way round"
    )
    return second, first


def _pressure_unit(one: _Seen) -> tuple[str, str]:
    largest = float(np.max(np.abs(_known(one))))
    if one.unit is not None and one.quantity == "pressure":
        return one.unit, "its name says"
    return unit_by_size(largest, PRESSURE_SIZES), f"its largest value is {largest:.3g}"


def _say_sign(found: Guess, angle: _Seen, command: Array) -> None:
    turned = correlation(angle.values, command)
    if turned < _AGAINST:
        found.doubts.append(
            f"{angle.name!r} falls where the command rises (correlation {turned:.2f}); `scale: -1` turns its sign, if "
            "that is not how the rig is built"
        )


def _one_in_one_out(found: Guess, rest: Sequence[_Seen]) -> None:
    named = [one for one in rest if one.has(_COMMAND)]
    entry = (named or list(rest))[0]
    if not named:
        found.doubts.append(f"{entry.name!r} is taken for the input because it comes first")
    others = [one for one in rest if one is not entry]
    out = next((one for one in others if one.has(_MEASURED)), others[0])
    channels: dict[str, dict[str, Any]] = {}
    for slot, one in (("input", entry), ("output", out)):
        unit = one.unit or "1"
        low, high = _range(_known(one))
        channels[slot] = {"name": _channel_name(one, slot), "unit": unit, "range": [low, high]}
        found.mapping["columns"][slot] = {"source": one.name} | ({"unit": unit} if one.unit else {})
        reached = f"{_known(one).min():.4g} to {_known(one).max():.4g} {unit}"
        found.meaning.append(f"{slot}: {one.name!r}, {reached}; range {low:g} to {high:g} {unit}")
        if not one.unit:
            found.doubts.append(f"the unit of {one.name!r} is not known: it is written 1")
    found.mapping["channels"] = channels
    found.doubts.append(
        "the ranges are those of this record; state what the rig moves in, the same for all its records"
    )
    if len(set(_own_columns(found))) < 2:
        channels["output"]["name"] = f"{channels['output']['name'][: LONGEST_NAME - 4]}_out"


def _channel_name(one: _Seen, slot: str) -> str:
    words = re.split(r"[^0-9a-z]+", one.name.rpartition("/")[2].lower())
    kept = [word for word in words if word and _UNIT_WORDS.get(word) != one.unit]
    name = "_".join(kept)[:LONGEST_NAME]
    return name if name.isidentifier() else slot


def _range(values: Array) -> tuple[float, float]:
    """The ends of what was reached, two digits of its width outwards; symmetric about 0 where it nearly is."""
    low, high = float(values.min()), float(values.max())
    if low < 0.0 < high and min(-low, high) > _NEARLY_SYMMETRIC * max(-low, high):
        low, high = -max(-low, high), max(-low, high)
    step = 10.0 ** (np.floor(np.log10(max(high - low, 1e-12))) - 1)
    ends = np.floor(low / step) * step, np.ceil(high / step) * step
    return float(f"{ends[0]:.12g}"), float(f"{ends[1]:.12g}")


def _further(found: Guess, rest: Sequence[_Seen]) -> None:
    """What has found no role is kept as a further channel, as far as there are places."""
    used = {entry["source"] for entry in found.mapping["columns"].values()}
    left = [one for one in rest if one.name not in used]
    taken = {*WIRES, *RESERVED, *_own_columns(found)}
    kept: dict[str, Mapping[str, str]] = {}
    for one in left[: len(PLACES)]:
        name = _free_name(one.name, taken)
        taken.add(name)
        kept[name] = {"source": one.name} | ({"unit": one.unit} if one.unit else {})
        found.meaning.append(f"further channel {name}: {one.name!r}{f' in {one.unit}' if one.unit else ''}")
    if kept:
        found.mapping["further"] = kept
    if len(left) > len(kept):
        lost = ", ".join(repr(one.name) for one in left[len(PLACES) :])
        found.doubts.append(f"no place for {lost}")


def _own_columns(found: Guess) -> list[str]:
    """The columns that the proposed channel map makes."""
    slots = found.mapping.get("channels", {}).values()
    return [Channel(slot["name"], slot["unit"], tuple(slot["range"])).column for slot in slots]


def _free_name(source: str, taken: Collection[str]) -> str:
    """A name of a column for what the file calls `source`, that nothing else has."""
    word = re.sub(r"\W+", "_", source.rpartition("/")[2].lower()).strip("_")
    word = (word if word.isidentifier() else f"column_{word}").strip("_")[: LONGEST_NAME - 3]
    numbered = (f"{word}_{number}" for number in itertools.count(2))
    return next(name for name in itertools.chain([word], numbered) if name not in taken)


def _add(found: Guess, name: str, one: _Seen, unit: tuple[str, str]) -> None:
    found.mapping["columns"][name] = {"source": one.name, "unit": unit[0]}
    values = _known(one)
    reached = f"{values.min():.4g} to {values.max():.4g}"
    found.meaning.append(f"{name}: {one.name!r} in {unit[0]} ({unit[1]}): {reached}")
