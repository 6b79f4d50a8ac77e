"""An hour of samples written and read by us, by mcap's own writer and readers, and by mcap-protobuf-support.

Each measurement of time and memory runs in a process of its own, so that peaks do not add up.
"""

import multiprocessing
import signal
import time
from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from rig.log.convert import CHUNK_ROWS
from rig.qualify.benchmarks import figure

SEED = 4
"""Of the samples' noise and of where files are damaged: the same in every run, so that runs can be compared."""
_STARTED_NS = 1_790_000_000_000_000_000


def against_peers(folder: Path, records: int) -> dict[str, Any]:
    """Figures of writing and reading `records` samples, ours beside the others'."""
    ours, plain = folder / "ours.mcap", folder / "plain.mcap"
    write, write_plain = measured_apart(_write_ours, ours, records), measured_apart(_write_plain, plain, records)
    bulk = measured_apart(_write_bulk, folder / "bulk.mcap", records)
    read, read_plain, read_protobuf = (
        measured_apart(function, ours, records) for function in (_read_ours, _read_plain, _read_protobuf)
    )
    return {
        "write, sample by sample": figure(write["seconds"], "s", "mcap Writer", write_plain["seconds"]),
        "write, from columns": figure(bulk["seconds"], "s", "mcap Writer", write_plain["seconds"]),
        "write, peak memory": figure(write["peak_mib"], "MiB", "mcap Writer", write_plain["peak_mib"]),
        "bytes a record": figure(
            ours.stat().st_size / records, "B", "mcap Writer, chunks of 1 MB", plain.stat().st_size / records
        ),
        "read as columns": figure(
            read["seconds"],
            "s",
            "mcap reader",
            read_plain["seconds"],
            goal=0.3,
            limit="zstd alone on the same chunks",
            limit_value=measured_apart(_unpack, ours, records)["seconds"],
        ),
        "read as columns, decoded": figure(read["seconds"], "s", "mcap-protobuf-support", read_protobuf["seconds"]),
        "read, peak memory": figure(
            read["peak_mib"], "MiB", limit="its columns", limit_value=read["data_mib"], goal=1.5 * read["data_mib"]
        ),
        "a slice of 10 s": figure(
            measured_apart(_read_slice, ours, records)["seconds"], "s", "mcap reader", _plain_slice(ours)
        ),
    }


def measured_apart(
    function: Callable[[Path, int], dict[str, float] | None], path: Path, records: int
) -> dict[str, float]:
    """Seconds and additional peak memory of `function(path, records)` in a fresh process; it times itself.
    ModuleNotFoundError when it needs a package that is not installed."""
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe(duplex=False)
    process = context.Process(target=_child, args=(function, path, records, theirs), daemon=True)
    process.start()
    theirs.close()
    result: dict[str, float] | ModuleNotFoundError = ours.recv()
    process.join()
    if isinstance(result, ModuleNotFoundError):
        raise result
    return result


def _child(
    function: Callable[[Path, int], dict[str, float] | None], path: Path, records: int, answer: Connection
) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the parent, which ends this process with itself
    try:
        answer.send(function(path, records))
    except ModuleNotFoundError as error:
        answer.send(error)  # whoever asked says which package it is


class _Watch:
    """Seconds and additional peak memory of what happens inside `with` (Linux: proc(5), clear_refs and status)."""

    def __enter__(self) -> "_Watch":
        Path("/proc/self/clear_refs").write_text("5", encoding="ascii")  # the peak begins anew here
        self._before = _resident_mib("VmRSS")
        self._start = time.perf_counter()
        return self

    def __exit__(self, *_: object) -> None:
        self.result = {"seconds": time.perf_counter() - self._start, "peak_mib": _resident_mib("VmHWM") - self._before}


def _resident_mib(name: str) -> float:
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith(name)) / 1024


def hour_of_samples(records: int) -> Any:
    """A run as the rig makes it: 12-bit counts, values computed from them, set-points in counts, a real machine's
    lateness."""
    import numpy as np

    from rig.log.mcap.columns import DTYPES, Samples
    from rig.sample import WIRES

    columns, due, tick = _columns_of_an_hour(records)
    counts_per_unit = 2.0**20  # as the rig keeps its values: 1e-6 of their unit
    for name in ("dp_cmd_mpa", "p1_cmd_mpa", "p2_cmd_mpa", "p1_mpa", "p2_mpa", "angle_deg"):
        columns[name] = np.rint(columns[name] * counts_per_unit) / counts_per_unit
    fields = {
        name: np.broadcast_to(columns.get(name, 0), records).astype(DTYPES[wire.kind]) for name, wire in WIRES.items()
    }
    return Samples(fields, due + _STARTED_NS, tick.astype(np.uint32))


def _columns_of_an_hour(records: int) -> tuple[dict[str, Any], Any, Any]:
    """The columns (n,) by name as the devices gave them, when each tick was due (ns), and the ticks' numbers."""
    import numpy as np

    from rig.excite.setpoints import around
    from rig.sample import Flag, Phase

    rng = np.random.default_rng(SEED)
    tick = np.arange(records, dtype=np.int64)
    due = 100_000_000_000 + tick * 5_000_000
    woken = due + np.abs(rng.normal(16_000, 6_000, records)).astype(np.int64)
    read = woken + rng.normal(120_000, 9_000, records).astype(np.int64)
    dp = 0.2 * np.sin(2 * np.pi * 0.5 * tick * 0.005)
    p1, p2 = around(0.2, dp)
    counts = {
        f"p{n}_raw": np.rint((1 + 8 * p + rng.normal(0, 0.002, records)) / 5 * 4095) for n, p in ((1, p1), (2, p2))
    }
    angle_raw = np.rint(2047 + 11.9 * 40 * np.sin(2 * np.pi * 0.5 * tick * 0.005 - 0.3) + rng.normal(0, 0.7, records))
    excitation = np.rint(4090 + rng.normal(0, 0.5, records))
    columns = counts | {
        "tick": tick,
        "scheduled_ns": due,
        "woken_ns": woken,
        "read_ns": read,
        "written_ns": read + rng.normal(60_000, 6_000, records).astype(np.int64),
        "dp_cmd_mpa": p1 - p2,
        "p1_cmd_mpa": p1,
        "p2_cmd_mpa": p2,
        "p1_mpa": (counts["p1_raw"] * 5 / 4095 - 1.003) / 3.98 * 0.5,
        "p2_mpa": (counts["p2_raw"] * 5 / 4095 - 0.991) / 4.02 * 0.5,
        "angle_deg": (angle_raw / excitation - 0.5) * 345.3 - 1.234,
        "angle_raw": angle_raw,
        "excitation_raw": excitation,
        "run": 1,
        "state": 2,
        "phase": int(Phase.SWEEP),
        "flags": int(Flag.ANGLE_ZEROED),
        "angle_zero_deg": 1.234,
    }
    return columns, due, tick


def _packed_hour(records: int) -> tuple[list[bytes], list[int]]:
    from rig.log.mcap.columns import pack_columns
    from rig.sample import WIRES

    samples = hour_of_samples(records)
    rows = pack_columns(samples.fields, WIRES)
    size, data = rows.dtype.itemsize, rows.tobytes()
    return [data[at : at + size] for at in range(0, len(data), size)], samples.log_time_ns.tolist()


def _write_ours(path: Path, records: int) -> dict[str, float]:
    from rig.log.mcap.writer import RunWriter

    messages, times = _packed_hour(records)
    with _Watch() as watch:
        writer = RunWriter(path, {"name": "hour"}, {})
        for number, (message, time_ns) in enumerate(zip(messages, times, strict=True), 1):
            writer.add(message, time_ns, number)
            if number % CHUNK_ROWS == 0:
                writer.close_chunk()
        writer.finish({"valid": True})
    return watch.result


def _write_bulk(path: Path, records: int) -> dict[str, float]:
    from rig.log.convert import LogContent, write_content

    content = LogContent(hour_of_samples(records), {"name": "hour"}, {"valid": True})
    with _Watch() as watch:
        write_content(content, path)
    return watch.result


def _write_plain(path: Path, records: int) -> dict[str, float]:
    from mcap.writer import Writer

    from rig.log.mcap.schema import sample_descriptor_set

    messages, times = _packed_hour(records)
    with _Watch() as watch, path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("pamrig.Sample", "protobuf", sample_descriptor_set())
        channel = writer.register_channel("/rig/sample", "protobuf", schema)
        for number, (message, time_ns) in enumerate(zip(messages, times, strict=True)):
            writer.add_message(channel, time_ns, message, time_ns, number)
        writer.finish()  # type: ignore[no-untyped-call]
    return watch.result


def _read_ours(path: Path, _: int) -> dict[str, float]:
    import numpy  # noqa: F401 - its own start is not what is measured

    from rig.log import reader

    with _Watch() as watch:
        (record,) = reader.read(path)
    return watch.result | {"data_mib": sum(column.nbytes for column in record.columns().values()) / 2**20}


def _unpack(path: Path, _: int) -> dict[str, float]:
    import zstandard

    from rig.log.mcap.reader import McapLog

    with McapLog(path) as log:
        zstd = zstandard.ZstdDecompressor()
        with _Watch() as watch:
            for chunk in log.contents.chunks:
                zstd.decompress(chunk.packed, max_output_size=chunk.size)
    return watch.result


def _read_plain(path: Path, _: int) -> dict[str, float]:
    from mcap.reader import make_reader

    with _Watch() as watch, path.open("rb") as file:
        kept = [
            message.data
            for _, _, message in make_reader(file, validate_crcs=True).iter_messages(topics=["/rig/sample"])
        ]
        del kept
    return watch.result


def _read_protobuf(path: Path, _: int) -> dict[str, float]:
    from mcap.reader import make_reader
    from mcap_protobuf.decoder import DecoderFactory

    with _Watch() as watch, path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        kept = [item.decoded_message.angle_deg for item in reader.iter_decoded_messages(topics=["/rig/sample"])]
        del kept
    return watch.result


def _read_slice(path: Path, records: int) -> dict[str, float]:
    from rig.log.mcap.reader import read_stretch

    first = _STARTED_NS + 100_000_000_000 + records // 2 * 5_000_000
    with _Watch() as watch:
        read_stretch(path, first, first + 10_000_000_000)
    return watch.result


def _plain_slice(path: Path) -> float:
    from mcap.reader import make_reader

    start = time.perf_counter()
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        middle = (summary.statistics.message_start_time + summary.statistics.message_end_time) // 2
        for _ in reader.iter_messages(starting_at=middle, ending_before=middle + 10_000_000_000):
            pass
    return time.perf_counter() - start
