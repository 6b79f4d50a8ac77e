"""What kind of file a log is, by its first bytes; its name is not asked."""

from enum import Enum, auto
from pathlib import Path

from rig.log.foreign.tables import TDMS_MAGIC
from rig.log.mcap.contents import map_file
from rig.log.mcap.framing import MAGIC


class FileKind(Enum):
    """MCAP (ours or another program's), LabVIEW's TDMS, or text: CSV, gzipped or not."""

    MCAP = auto()
    TDMS = auto()
    TEXT = auto()


def kind_of(path: Path) -> FileKind:
    """The kind of the file at `path`; RecordError when it cannot be opened."""
    head = bytes(map_file(path)[: len(MAGIC)])
    if head == MAGIC:
        return FileKind.MCAP
    return FileKind.TDMS if head[:4] == TDMS_MAGIC else FileKind.TEXT
