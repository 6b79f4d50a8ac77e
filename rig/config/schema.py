"""Plain data as a dataclass, by its annotations and by what `bounded` allows: what `rig.config` builds configs with.

A module of its own, for cattrs is a good part of what a process of the rig would load: those that are handed a rig as
it was loaded have no schema to go by.
"""

import dataclasses
import math
import os
import sys
from collections.abc import Mapping
from enum import Enum
from pathlib import Path
from typing import Any, TypeGuard, TypeVar, cast, get_args, get_origin

import cattrs
from cattrs.errors import ClassValidationError, ForbiddenExtraKeysError, IterableValidationError
from cattrs.gen import make_dict_structure_fn

from rig.config.wording import LONG_NUMBER, shown, suggest
from rig.errors import ConfigError

T = TypeVar("T")


def structured(raw: object, schema: type[T], where: str) -> T:
    """`raw` as a `schema`; ConfigError, which `where` opens."""
    if get_origin(schema) is dict and not isinstance(raw, dict):
        raise ConfigError(f"{where}: expected a mapping, got {shown(raw)}")
    try:
        return _CONVERTER.structure(raw, schema)
    except (ClassValidationError, IterableValidationError, ValueError, TypeError, KeyError) as error:
        path, leaf = _first_leaf(error)
        raise ConfigError(f"{where}: {_join(path)}{_explain(leaf)}") from None


def _structure_float(raw: object, _: type) -> float:
    if isinstance(raw, bool) or not isinstance(raw, int | float):
        raise ValueError(f"expected a number, got {shown(raw)}")
    try:
        value = float(raw)
    except OverflowError:
        raise ValueError(f"expected a number below {sys.float_info.max:.2g}, got {shown(raw)}") from None
    if not math.isfinite(value):
        raise ValueError(f"expected a finite number, got {raw}")
    return value


def _structure_int(raw: object, _: type) -> int:
    if isinstance(raw, bool) or not isinstance(raw, int):
        raise ValueError(f"expected a whole number, got {shown(raw)}")
    return raw


def _structure_bool(raw: object, _: type) -> bool:
    if not isinstance(raw, bool):
        raise ValueError(f"expected true or false, got {shown(raw)}")
    return raw


def _structure_str(raw: object, kind: type) -> str:
    if issubclass(kind, Enum):  # the converter comes here for a StrEnum too
        return cast(str, _structure_enum(raw, kind))
    if not isinstance(raw, str):
        raise ValueError(f"expected text, got {shown(raw)}")
    return raw


def _structure_path(raw: object, _: type) -> Path:
    text = _structure_str(raw, str)
    if not _can_be_a_name(text):
        raise ValueError(f"expected a path, got {shown(raw)} with a character that no file name can have")
    return Path(text)


def _can_be_a_name(text: str) -> bool:
    try:
        return b"\0" not in os.fsencode(text)
    except UnicodeEncodeError:
        return False


def _structure_enum(raw: object, kind: type[Enum]) -> Enum:
    try:
        return kind(raw)
    except ValueError:
        raise ValueError(f"unknown value {shown(raw)}; {suggest(str(raw), [str(m.value) for m in kind])}") from None


def _structure_mapping(raw: object, kind: Any) -> Any:
    if not isinstance(raw, dict):
        raise ValueError(f"expected a mapping, got {shown(raw)}")
    key_type, item_type = get_args(kind)
    return {_below(str(key), key, key_type): _below(str(key), item, item_type) for key, item in raw.items()}


def _is_mapping(kind: Any) -> bool:
    return get_origin(kind) is dict


def _is_sequence(kind: Any) -> bool:
    return get_origin(kind) in (list, tuple)


def _structure_sequence(raw: object, kind: Any) -> Any:
    if not isinstance(raw, list):
        raise ValueError(f"expected a list, got {shown(raw)}")
    args = get_args(kind)
    if get_origin(kind) is list or args[-1] is Ellipsis:
        types = [args[0]] * len(raw)
    else:
        types = list(args)
        if len(raw) != len(types):
            raise ValueError(f"expected {len(types)} values, got {len(raw)}")
    items = [_below(f"[{index}]", *pair) for index, pair in enumerate(zip(raw, types, strict=True))]
    return items if get_origin(kind) is list else tuple(items)


def _below(step: str, item: object, kind: Any) -> Any:
    """An item of a list or a mapping; its error carries the step to it."""
    try:
        return _CONVERTER.structure(item, kind)
    except Exception as error:
        error.__notes__ = [*getattr(error, "__notes__", []), _Step(step)]
        raise


class _Step(str):
    """A step of a key's path, attached to an error on its way up."""


def _dataclass_hook(kind: type) -> Any:
    def hook(raw: object, _: type) -> Any:
        if not isinstance(raw, dict):
            names = ", ".join(f.name for f in dataclasses.fields(kind))
            raise ValueError(f"expected a mapping with the keys {names}; got {shown(raw)}")
        _check_numbers(raw, kind)
        return inner(raw, kind)

    inner = make_dict_structure_fn(cast(Any, kind), _CONVERTER, _cattrs_forbid_extra_keys=True)
    return hook


_CONVERTER = cattrs.Converter(detailed_validation=True)
_CONVERTER.register_structure_hook(float, _structure_float)
_CONVERTER.register_structure_hook(int, _structure_int)
_CONVERTER.register_structure_hook(bool, _structure_bool)
_CONVERTER.register_structure_hook(str, _structure_str)
_CONVERTER.register_structure_hook(Path, _structure_path)
_CONVERTER.register_structure_hook_func(_is_mapping, _structure_mapping)
_CONVERTER.register_structure_hook_func(_is_sequence, _structure_sequence)
_CONVERTER.register_structure_hook_func(lambda kind: isinstance(kind, type) and issubclass(kind, Enum), _structure_enum)
_CONVERTER.register_structure_hook_factory(
    lambda kind: isinstance(kind, type) and dataclasses.is_dataclass(kind), _dataclass_hook
)


def _first_leaf(error: BaseException) -> tuple[list[str], BaseException]:
    """The path of keys to the first thing that is wrong, and that thing."""
    path: list[str] = []
    while True:
        path += [_step(note) for note in reversed(getattr(error, "__notes__", []))]
        if not isinstance(error, ClassValidationError | IterableValidationError):
            break
        # a misspelt key also leaves its right spelling missing: name what was written
        error = next((e for e in error.exceptions if isinstance(e, ForbiddenExtraKeysError)), error.exceptions[0])
    if isinstance(error, KeyError) and path and path[-1] == error.args[0]:
        path.pop()  # the message names the missing key itself
    return path, error


def _step(note: str) -> str:
    """One step of the path from a note of cattrs (which carries a name or an index) or of ours."""
    if isinstance(note, _Step):
        return note
    if (name := getattr(note, "name", None)) is not None:
        return str(name)
    index = getattr(note, "index", note)
    return f"[{index}]" if isinstance(index, int) else str(index)


def _join(path: list[str]) -> str:
    text = ".".join(path).replace(".[", "[")
    return f"{text}: " if text else ""


def _explain(error: BaseException) -> str:
    if isinstance(error, ForbiddenExtraKeysError):
        unknown: object = min(error.extra_fields, key=str)
        if _is_number(unknown):
            return f"a number, {unknown}, stands where a key should; decimals have a point, not a comma"
        return (
            f"unknown key {unknown!r}; "
            f"{suggest(str(unknown), [f.name for f in dataclasses.fields(cast(Any, error.cl))])}"
        )
    if isinstance(error, KeyError):
        return f"the key {error.args[0]!r} is missing"
    return str(error)


def _check_numbers(raw: Mapping[Any, Any], kind: type) -> None:
    """ValueError for a number outside its field's range, before anything is built from it: what is built may be as
    large."""
    for item in dataclasses.fields(kind):
        if "low" in item.metadata and item.name in raw:
            try:
                _check_range(raw[item.name], item.metadata)
            except ValueError as error:
                error.__notes__ = [_Step(item.name)]
                raise


def _check_range(given: object, allowed: Mapping[str, Any]) -> None:
    unit = f" {allowed['unit']}" if allowed["unit"] else ""
    for number in given if isinstance(given, list) else (given,):
        if _is_number(number) and not allowed["low"] <= number <= allowed["high"]:
            meant = _in_another_unit(number, allowed)
            raise ValueError(
                f"{_amount(number)}{unit} is outside {allowed['low']:g} .. {allowed['high']:g}{unit}{meant}"
            )


_OTHER_UNITS: Mapping[str, tuple[tuple[str, float, float, float], ...]] = {
    "MPa": (("bar", 0.1, 1.0, 10.0), ("kPa", 1e-3, 10.0, 1000.0)),
    "MPa/s": (("bar/s", 0.1, 1.0, 1e3), ("kPa/s", 1e-3, 10.0, 1e5)),
    "s": (("ms", 1e-3, 50.0, 1e5),),
    "ms": (("s", 1e3, 1e-4, 0.5),),
}
"""Unit of a key -> units in which people think: how much of the key's one is, and which numbers it usually has."""


def _in_another_unit(number: float, allowed: Mapping[str, Any]) -> str:
    """The end of a message: what the number is where another unit was meant."""
    for unit, times, least, most in _OTHER_UNITS.get(allowed["unit"], ()):
        if least <= number <= most and allowed["low"] <= number * times <= allowed["high"]:
            return f"; {number:g} {unit} are {number * times:g} {allowed['unit']}"
    return ""


def _is_number(given: Any) -> TypeGuard[int | float]:
    """One to be compared: what is no number, or not finite, is told by its own check."""
    return (
        isinstance(given, int | float)
        and not isinstance(given, bool)
        and not (given != given or abs(given) == math.inf)
    )


def _amount(number: int | float) -> str:
    return shown(number) if isinstance(number, int) and abs(number) >= LONG_NUMBER else f"{number:g}"
