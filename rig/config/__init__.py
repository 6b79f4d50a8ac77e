"""Configs: YAML in, plain dataclasses out, strictly. Pure Python throughout, so that it runs on the controller.

A dataclass is the schema: its field names are the keys, its annotations the types, and `rig.fields.bounded` adds a
range. Whatever is wrong ends in one ConfigError line: the file, the path of the key, what stands there and what is
allowed.
"""

import dataclasses
import errno
import math
from collections.abc import Mapping
from enum import Enum
from pathlib import Path
from typing import Any, TypeVar

from rig.config.wording import nearest_file, one_line, shown, suggest
from rig.errors import ConfigError

__all__ = [
    "check_regular", "finite", "load", "nearest_file", "one_line", "parse_yaml", "read_text", "read_yaml",
    "shown", "structure", "suggest", "unstructure",
]  # fmt: skip

T = TypeVar("T")
MOST_CONFIG_BYTES = 4 * 1024 * 1024
"""No config is longer; what is, was meant for another program."""


def load(path: Path, schema: type[T]) -> T:
    """The config at `path` as a `schema`; ConfigError when it cannot be read or does not fit."""
    return structure(read_yaml(path), schema, str(path))


def structure(raw: object, schema: type[T], where: str) -> T:
    """Plain YAML data as a `schema`. `where` opens the message of an error: a file, or a file and a key."""
    from rig.config.schema import (
        structured,
    )  # late, as YAML is: a process that is handed a rig as it was loaded needs neither

    return structured(raw, schema, where)


def read_yaml(path: Path) -> object:
    """The YAML at `path` as plain data; ConfigError names the line when it is broken, and what is too large before it
    is built."""
    return parse_yaml(read_text(path), path)


def parse_yaml(text: str, path: Path) -> object:
    """The same of what was read from `path`, for who keeps it too."""
    import yaml

    from rig.config import strict_yaml

    try:
        return strict_yaml.built(text)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark
        line = f", line {mark.line + 1}" if mark else ""
        raise ConfigError(f"{path}{line}: not valid YAML: {strict_yaml.problem(error)}") from None
    except (yaml.YAMLError, ValueError) as error:
        raise ConfigError(f"{path}: not valid YAML: {' '.join(str(error).split())}") from None
    except RecursionError:
        raise ConfigError(f"{path}: not valid YAML: nested too deeply") from None


def read_text(path: Path, most_bytes: int = MOST_CONFIG_BYTES) -> str:
    """What stands in a file of text; ConfigError, one line, when it cannot be read or is longer than that."""
    try:
        return _text(path, most_bytes)
    except FileNotFoundError:
        raise ConfigError(f"{path}: no such file{nearest_file(path)}") from None
    except IsADirectoryError:
        raise ConfigError(f"{path}: cannot be read: it is a folder, and a file is meant") from None
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(
            f"{path}: cannot be read: {getattr(error, 'strerror', None) or 'it is not UTF-8 text'}"
        ) from None
    except ValueError:
        raise ConfigError(f"{str(path)!r}: cannot be read: no file can have such a name") from None


def _text(path: Path, most_bytes: int) -> str:
    check_regular(path, most_bytes)
    return path.read_bytes().decode("utf-8")  # every line with the end that it has


def check_regular(path: Path, most_bytes: int | None = None) -> None:
    """OSError for what is not to be opened: a pipe may never end, a device is endless, and a file may be too long."""
    if path.exists() and not path.is_file() and not path.is_dir():
        raise OSError(errno.EINVAL, "it is not a regular file")
    if most_bytes is not None and path.is_file() and (size := path.stat().st_size) > most_bytes:
        raise OSError(errno.EFBIG, f"it has {size} bytes, allowed are {most_bytes}")


def finite(value: Any) -> float:
    """A number from a file of plain data; ValueError or OverflowError for one that is none."""
    number = float(value)
    if not math.isfinite(number):
        raise ValueError(f"{shown(value)} is no finite number")
    return number


def unstructure(value: object) -> Any:
    """A config as plain data for YAML or JSON; paths and enums become text."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {f.name: unstructure(getattr(value, f.name)) for f in dataclasses.fields(value)}
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, Mapping):
        return {str(key): unstructure(item) for key, item in value.items()}
    if isinstance(value, list | tuple | set | frozenset):
        return [unstructure(item) for item in value]
    return str(value) if isinstance(value, Path) else value
