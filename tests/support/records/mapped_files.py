"""A file of another program read by a mapping, in one step."""

from pathlib import Path
from typing import Any

from rig.log.foreign.mapping import Mapping, mapped, raw_table
from rig.log.mcap.columns import Array


def read_mapped(path: Path, mapping: Mapping) -> tuple[dict[str, Array], dict[str, Any]]:
    return mapped(raw_table(path, mapping), mapping)
