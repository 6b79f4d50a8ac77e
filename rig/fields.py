"""Dataclass fields that say which numbers they allow; the schema of every config. Standard library only."""

import dataclasses
from typing import Any


def bounded(low: float, high: float, unit: str = "", **default: Any) -> Any:
    """A number field that allows low..high; `default` or `default_factory` as for dataclasses.field.

    For a list of numbers the range holds for each of them. `rig.config` checks it when a config is loaded.
    """
    return dataclasses.field(metadata={"low": low, "high": high, "unit": unit}, **default)
