"""An MCAP file of ours opened for reading: facts, attachments, log lines, and samples of any stretch of time.

Nothing is decompressed before it is asked for, and nothing is believed before its CRC held. Files that are not whole
are refused here; rig.log.check says what is wrong with them and rig.log.recover saves what can be saved.
"""

from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Final, Self

from rig.errors import RecordError
from rig.log.mcap import schema
from rig.log.mcap.collector import LogLine, SampleCollector, is_sample_channel
from rig.log.mcap.columns import Samples
from rig.log.mcap.contents import indexed, let_go, map_file, walk
from rig.log.mcap.framing import Chunk, DamageError, Unpacker
from rig.sample import WIRES

_LET_GO_CHUNKS: Final = 256
"""After so many chunks the file's pages are given back: some 2 MB of ours."""


class McapLog:
    """A finished MCAP file. Use as a context manager; RecordError when it cannot be read or is not whole."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._data = map_file(path)
        try:
            self.contents = walk(self._data)
        except DamageError as error:
            raise self._not_whole(error) from None
        self.run_facts = self.contents.facts(schema.RUN_METADATA)
        self.result_facts = self.contents.facts(schema.RESULT_METADATA)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.contents.chunks.clear()
        self.contents.loose.clear()
        self._data.release()

    @property
    def attachments(self) -> dict[str, bytes]:
        """File name -> content, as they were put in by the writer."""
        return self.contents.attachments

    def samples(
        self, first_ns: int | None = None, last_ns: int | None = None, names: Collection[str] = tuple(WIRES)
    ) -> Samples:
        """The samples of all phases whose log time lies in first_ns..last_ns, their fields `names`; only the chunks in
        that span are opened."""
        samples = self._collect(first_ns, last_ns, names)[0]
        if first_ns is None and last_ns is None:
            return samples
        low, high = first_ns if first_ns is not None else -(1 << 63), last_ns if last_ns is not None else (1 << 63) - 1
        return samples.rows((samples.log_time_ns >= low) & (samples.log_time_ns <= high))

    def everything(self) -> tuple[Samples, list[LogLine]]:
        """All samples and all log lines, in one pass."""
        return self._collect(None, None)

    def _collect(
        self, first_ns: int | None, last_ns: int | None, names: Collection[str] = tuple(WIRES)
    ) -> tuple[Samples, list[LogLine]]:
        collector = SampleCollector(self.contents, len(self._data), names)
        try:
            opened = Unpacker(len(self._data)).open_ahead(self._chunks(first_ns, last_ns))
            for number, (chunk, data) in enumerate(opened):
                collector.feed(data, chunk.start)
                if number % _LET_GO_CHUNKS == 0:
                    let_go(self._data)
            for block in self.contents.loose:
                collector.feed(bytes(self._data[block.start : block.end]), block.start)
            samples = collector.samples()
        except DamageError as error:
            raise self._not_whole(error) from None
        self._require_samples()
        return samples, collector.lines

    def _chunks(self, first_ns: int | None, last_ns: int | None) -> Iterator[Chunk]:
        """Those of the span, and the first, which holds the schema."""
        for number, chunk in enumerate(self.contents.chunks):
            early, late = (
                first_ns is not None and chunk.last_ns < first_ns,
                last_ns is not None and chunk.first_ns > last_ns,
            )
            if number == 0 or not (early or late):
                yield chunk

    def _require_samples(self) -> None:
        channels, kinds = self.contents.channels.values(), self.contents.schemas
        if any(item.schema_id in kinds and is_sample_channel(item, kinds[item.schema_id]) for item in channels):
            return
        wanted, has = f"{schema.SAMPLE_TOPIC} of {schema.SAMPLE_SCHEMA}", self.contents.describe_channels()
        raise RecordError(
            f"{self.path}: no channel {wanted}; it has {has}; `pamrig log import` maps others by a YAML file"
        )

    def _not_whole(self, error: DamageError) -> RecordError:
        hint = "" if error.offset == 0 else "; `pamrig log recover` saves what is whole"
        return RecordError(f"{self.path}: {error}{hint}")


def read_stretch(path: Path, first_ns: int, last_ns: int) -> Samples:
    """The samples of all phases with log time first_ns..last_ns, found by the file's index: only their chunks are
    touched.

    Index and chunks are under CRCs of their own; the rest of the file is not looked at. RecordError as for McapLog.
    """
    data = map_file(path)
    contents = indexed(data, first_ns, last_ns)
    if contents is None:  # no index that proves itself: the whole file is gone through, and its damage is found
        with McapLog(path) as log:
            return log.samples(first_ns, last_ns)
    try:
        samples = SampleCollector(contents, len(data)).all_chunks(data)
    except DamageError as error:
        raise RecordError(f"{path}: {error}; `pamrig log recover` saves what is whole") from None
    return samples.rows((samples.log_time_ns >= first_ns) & (samples.log_time_ns <= last_ns))
