"""One run into one MCAP file: what the recorder process calls for every sample, message and flush.

The file grows as NAME.mcap.partial and gets its name when it is finished. Pure Python (mcap, protobuf and the standard
library), so that it runs on the controller. Turning columns into a file is in rig.log.convert.
"""

import errno
import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from rig.errors import RecordError
from rig.log.mcap import schema
from rig.log.mcap.frame_writer import McapWriter
from rig.outputs import NO_LINKS, check_free, keep_names
from rig.sample import SAMPLE_BYTES, Wire

PARTIAL_SUFFIX: Final = ".partial"
BACKLOG_BYTES: Final = 8 << 20
"""How much may wait in memory while the disk takes nothing; beyond it samples are dropped and counted."""
CHUNK_SAMPLES: Final = 200
"""At most, in a chunk of samples that come one by one, which is what a flipped byte costs: 1 s at 5 ms. A recorder on
the real clock closes them sooner, with each flush; in virtual time minutes pass between two."""

_NO_ROOM: Final = (errno.ENOSPC, errno.EDQUOT)
"""What a full disk says of a second name; one name in the place of another needs no room."""
_MEDIA_TYPES = {".yaml": "application/yaml", ".json": "application/json", ".txt": "text/plain"}


class _Tail:
    """A file that only grows. What could not be written stays queued in order, so a full disk loses nothing once it has
    room."""

    def __init__(self, path: Path) -> None:
        self._fd = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o644)
        self._made = os.fstat(self._fd)
        self._written = 0
        self._spoilt = False
        self.pending = bytearray()

    def write(self, data: bytes) -> int:
        self.pending += data
        return len(data)

    def tell(self) -> int:
        return self._written + len(self.pending)

    def flush(self) -> None:
        while self.pending:
            self._spoilt = not self.is_ours  # before the hole is hidden by what is written behind it
            count = os.write(self._fd, self.pending)
            del self.pending[:count]
            self._written += count

    def sync(self) -> None:
        self.flush()
        os.fsync(self._fd)

    def is_at(self, path: Path) -> bool:
        try:
            return os.path.samestat(os.stat(path), self._made)
        except OSError:
            return False

    @property
    def is_ours(self) -> bool:
        """It was always as long as it was written here; somebody who cuts it, as log rotation does, leaves a hole of
        zeros."""
        return not self._spoilt and (self._fd < 0 or os.fstat(self._fd).st_size == self._written)

    def close(self) -> None:
        if self._fd >= 0:
            os.close(self._fd)
            self._fd = -1


class RunWriter:
    """Writes one run. Not thread-safe. RecordError when the file exists already or the disk refuses."""

    def __init__(
        self, path: Path, facts: Mapping[str, Any], attachments: Mapping[str, bytes], unfinished: str = PARTIAL_SUFFIX
    ) -> None:
        """Opens PATH.partial and puts `facts` (as `pamrig.run`) and `attachments` (file name -> content) on the disk at
        once.

        `unfinished` is another ending for conversions, whose leftovers are no recordings.

        `facts["started_ns"]`, nanoseconds since the Unix epoch, stamps the attachments; 0 without it.
        """
        self.path = path
        self.partial = path.with_name(path.name + unfinished)
        self._recording = unfinished == PARTIAL_SUFFIX
        self._said = self.partial if self._recording else path
        """What a message calls it: what a recording has so far is found under its name."""
        self.records = self._chunk_began = 0
        self.dropped = 0
        """Samples that were not written because the disk took nothing for too long."""
        check_free([path])
        self._tail = self._open_tail()
        try:
            self._writer = McapWriter(self._tail, "pamrig")
            self.sample_channel, self.log_channel = self._head(facts, attachments)
            self.flush()
        except BaseException:
            self.discard()  # nobody has it yet, and it holds no sample
            raise

    def add(self, packed: bytes | memoryview, log_time_ns: int, sequence: int) -> None:
        """One packed sample; `log_time_ns` counts from the Unix epoch, a gap in `sequence` is a sample lost on the
        way."""
        if len(packed) != SAMPLE_BYTES:
            raise ValueError(f"a packed sample has {SAMPLE_BYTES} bytes, not {len(packed)}")
        if len(self._tail.pending) > BACKLOG_BYTES:
            self.dropped += 1
            return
        self._writer.add_message(self.sample_channel, sequence & 0xFFFFFFFF, log_time_ns, packed)
        self.records += 1
        if self.records - self._chunk_began >= CHUNK_SAMPLES:
            self._close_chunk()

    def add_records(self, records: bytes | memoryview, times_ns: Sequence[int]) -> None:
        """Whole message records of samples, from rig.log.mcap.columns.message_rows; for who converts a file."""
        self._writer.add_records(self.sample_channel, records, times_ns)
        self.records += len(times_ns)

    def open_channel(self, topic: str, kind: str, wires: Mapping[str, Wire]) -> int:
        """A further channel of flat Protobuf messages `kind` with the fields `wires`; returns its number for `put`."""
        schema_id = self._writer.add_schema(kind, "protobuf", schema.descriptor_set(kind, wires))
        return self._writer.add_channel(topic, "protobuf", schema_id, schema.field_metadata(wires))

    def put(self, channel: int, message: bytes, log_time_ns: int) -> None:
        """One message into a channel of `open_channel`."""
        self._writer.add_message(channel, 0, log_time_ns, message)

    def log(self, level: str, message: str, time_ns: int) -> None:
        """One line for people on `/log`; `level` is debug, info, warning, error or fatal."""
        self._writer.add_message(self.log_channel, 0, time_ns, schema.log_message(level, message, time_ns))

    def flush(self) -> None:
        """Close the chunk and put everything on the disk: a kill after this loses nothing from before it.

        RecordError when the disk refuses; what is waiting is kept and goes out with the next flush that succeeds.
        """
        try:
            self._close_chunk()
            self._tail.sync()
        except OSError as error:
            raise self._refused(error) from None
        self._check_there()

    def _check_there(self) -> None:
        """RecordError when something else, or nothing, stands in its place, or what somebody else has cut or written
        to: that must not get its name."""
        if not self._is_there:
            raise RecordError(f"{self.partial}: was deleted or moved while it was being written")
        if not self._tail.is_ours:
            raise RecordError(f"{self.partial}: was cut or written to by somebody else while it was being written")

    @property
    def gone(self) -> bool:
        """The file that is being written is not any more where it was begun, or not what was written: somebody deleted
        or moved it, or its folder, cut it or wrote to it."""
        return not (self._is_there and self._tail.is_ours)

    @property
    def _is_there(self) -> bool:
        return self._tail.is_at(self.partial)

    def close_chunk(self) -> None:
        """Close the chunk without waiting for the disk: for who converts a file and can do it again."""
        try:
            self._close_chunk()
            self._tail.flush()
        except OSError as error:
            raise self._refused(error) from None

    def finish(self, facts: Mapping[str, Any]) -> Path:
        """Write `facts` (as `pamrig.result`) and the index, and give the file its name, which is returned.

        Adds `records`; samples dropped here add to `dropped` and make `valid` false. Where `facts` say nothing of
        `valid`, nobody watched the run, and the file says nothing of it either (docs/decisions/0215).
        """
        result = dict(facts) | {"records": self.records, "dropped": schema.count_of(facts, "dropped") + self.dropped}
        if "valid" in facts or self.dropped:
            result["valid"] = bool(facts.get("valid")) and not self.dropped
        try:
            self._writer.close_chunk()
            self._writer.add_metadata(schema.RESULT_METADATA, schema.facts_to_text(result))
            self._writer.finish()
            self._tail.sync()
            self._check_there()
        except OSError as error:
            raise self._refused(error) from None
        finally:
            self._tail.close()
        take_name(self.partial, self.path, recording=self._recording)
        return self.path

    def abort(self) -> None:
        """Let go of the file as it is: NAME.mcap.partial stays, up to the last flush. Idempotent."""
        self._tail.close()

    def discard(self) -> None:
        """Let go of the file and remove it, if it is still there and may be removed: for who converts a file and
        failed."""
        self._tail.close()
        if self._is_there:
            with suppress(OSError):  # read-only by now: why nothing was written is told already
                self.partial.unlink()

    def _close_chunk(self) -> None:
        self._writer.close_chunk()
        self._chunk_began = self.records

    def _open_tail(self) -> _Tail:
        try:
            return _Tail(self.partial)
        except FileExistsError:
            raise RecordError(
                f"{self.partial}: an unfinished recording lies there; recover it or move it away"
            ) from None
        except OSError as error:
            raise self._refused(error) from None

    def _head(self, facts: Mapping[str, Any], attachments: Mapping[str, bytes]) -> tuple[int, int]:
        """Everything that stands before the first sample; returns the channels of samples and of log lines."""
        writer = self._writer
        writer.add_metadata(schema.RUN_METADATA, schema.facts_to_text(facts))
        started_ns = schema.count_of(facts, "started_ns")
        for name, data in attachments.items():
            writer.add_attachment(
                name, _MEDIA_TYPES.get(Path(name).suffix, "application/octet-stream"), data, started_ns
            )
        sample_schema = writer.add_schema(schema.SAMPLE_SCHEMA, "protobuf", schema.sample_descriptor_set())
        log_schema = writer.add_schema(schema.LOG_SCHEMA, "jsonschema", schema.log_json_schema())
        samples = writer.add_channel(schema.SAMPLE_TOPIC, "protobuf", sample_schema, schema.sample_channel_metadata())
        return samples, writer.add_channel(schema.LOG_TOPIC, "json", log_schema, {})

    def _refused(self, error: OSError) -> RecordError:
        return RecordError(f"{self._said}: cannot be written: {error.strerror}")


def take_name(partial: Path, path: Path, *, recording: bool) -> None:
    """Give the finished file `partial` the name `path`; RecordError, and `partial` stays, when that name is taken.

    Of a `recording` that is said; what a conversion has made goes with it.
    """
    try:
        os.link(partial, path)  # unlike a rename, refuses a name that is taken
        os.unlink(partial)
    except FileExistsError:
        what = f"the new recording is whole and stays at {partial}" if recording else "a log is never overwritten"
        raise RecordError(f"{path}: exists already; {what}") from None
    except OSError as error:
        if error.errno not in (*NO_LINKS, *_NO_ROOM) or os.path.lexists(path):
            raise RecordError(f"{path}: cannot be written: {error.strerror}") from None
        _rename(partial, path)
    keep_names(path.parent)


def _rename(partial: Path, path: Path) -> None:
    try:
        os.rename(partial, path)
    except OSError as error:
        raise RecordError(f"{path}: cannot be written: {error.strerror}") from None
