"""What `pamrig bench record` measures beside: how few bytes the samples of a file could be, what mcap's own writer
makes of them, and how fast the loop is when nobody records."""

import io
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig.app import compose
from rig.app.loop_process import loop_settings
from rig.realtime.clock import VirtualClock
from rig.realtime.commands import Mailbox, Script
from rig.realtime.loop import Loop
from rig.realtime.program import Program
from rig.realtime.ring import Ring, RingWriter
from rig.rig_config import RigConfig

if TYPE_CHECKING:
    from rig.log.mcap.columns import Samples


def peers_of(path: Path) -> dict[str, float]:
    """Bytes a record of a finished file's samples by mcap's own writer, and by their entropy."""
    from rig.log.reader import read_samples

    samples = read_samples(path)
    return {"mcap_bytes": _by_mcap(samples), "entropy_bytes": _entropy_bytes(samples)}


def _by_mcap(samples: "Samples") -> float:
    """In chunks of 1 MB, compressed by zstd, as it does by default."""
    from mcap.writer import Writer

    from rig.log.mcap.columns import pack_columns
    from rig.log.mcap.schema import sample_descriptor_set
    from rig.sample import WIRES

    file = io.BytesIO()
    writer = Writer(file)
    writer.start()
    schema = writer.register_schema("pamrig.Sample", "protobuf", sample_descriptor_set())
    channel = writer.register_channel("/rig/sample", "protobuf", schema)
    for number, row in enumerate(pack_columns(samples.fields, WIRES)):
        at_ns = int(samples.log_time_ns[number])
        writer.add_message(channel, at_ns, row.tobytes(), at_ns, number)
    writer.finish()  # type: ignore[no-untyped-call]
    return len(file.getvalue()) / len(samples)


def _entropy_bytes(samples: "Samples") -> float:
    """Sum over the fields of the entropy of their values, or of their steps where that is less: what a coder could
    reach that knows each field's frequencies, and no field by another. Of a short file it is too low: none of its
    numbers comes often enough."""
    import numpy as np

    def bits(column: Any) -> float:
        counts = np.unique(column, return_counts=True)[1] / len(column)
        return float(-(counts * np.log2(counts)).sum())

    return sum(min(bits(column), bits(np.diff(column))) for column in samples.fields.values()) / 8


def alone(rig: RigConfig, programs: list[Program]) -> float:
    """How many times as fast as real time the loop carries programs out when nobody reads what it puts out."""
    clock = VirtualClock()
    device = compose.make_device(rig, clock)
    device.open()
    script = Script(programs, Mailbox.private())
    loop = Loop(device, clock, RingWriter(Ring.private()), script, loop_settings(rig))
    began = time.perf_counter()
    loop.run()
    return clock.now_ns() / 1e9 / (time.perf_counter() - began)
