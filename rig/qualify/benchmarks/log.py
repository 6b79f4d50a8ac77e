"""`pamrig bench log`: an hour of samples written and read beside mcap's own writer and readers; recovery; killed
recorders.

The comparison itself is in log_peers. Quote the ratios.
"""

import random
import statistics
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from rig.log.convert import CHUNK_ROWS
from rig.qualify.benchmarks import figure
from rig.qualify.benchmarks.log_peers import SEED, against_peers, hour_of_samples
from rig.qualify.benchmarks.recorder_kill import killed_recordings

HOUR_RECORDS = 720_000
"""Samples of an hour at 5 ms."""
DAMAGES = 200
KILLS = 50
"""Files that are damaged, and recorders that are killed; each somewhere else, drawn by SEED."""
_COUNTED = "recovery is judged by what it saves"


def bench_log(records: int = HOUR_RECORDS, damages: int = DAMAGES, kills: int = KILLS) -> dict[str, Any]:
    """All figures of logs. Smaller numbers make it quicker and less telling."""
    with TemporaryDirectory(prefix="pamrig-bench-") as name:
        folder = Path(name)
        return against_peers(folder, records) | _recovery(folder, damages) | _kills(folder, kills)


def _recovery(folder: Path, damages: int) -> dict[str, Any]:
    """Cuts and flipped bytes: share of the samples that were saved of those in undamaged chunks, and samples that are
    false."""
    from rig.log.convert import LogContent, write_content

    content = LogContent(hour_of_samples(6000), {"name": "minute"}, {"valid": True, "records": 6000})
    source = write_content(content, folder / "minute.mcap")
    rng, out = random.Random(SEED), {}
    for kind in ("cut", "flipped byte"):
        results = [_damaged(source, content.samples, kind, rng) for _ in range(damages)]
        saved, savable, false = (sum(column) for column in zip(*((r[0], r[1], r[2]) for r in results), strict=True))
        out[f"recovery, {kind}: saved of what was whole"] = figure(
            saved / savable, "share", better="higher", goal=1.0, trials=damages, why=_COUNTED
        )
        out[f"recovery, {kind}: false samples"] = figure(false, "samples", goal=0, why=_COUNTED)
        out[f"recovery, {kind}: median time"] = figure(statistics.median(r[3] for r in results), "s", why=_COUNTED)
    return out


def _damaged(source: Path, samples: Any, kind: str, rng: random.Random) -> tuple[int, int, int, float]:
    """Saved samples, samples in chunks that the damage left whole, false samples, seconds."""
    import numpy as np

    from rig.errors import RecordError
    from rig.log.mcap.contents import map_file, walk
    from rig.log.reader import read_samples
    from rig.log.recover import recover

    data, starts = bytearray(source.read_bytes()), [chunk.start for chunk in walk(map_file(source)).chunks]
    ends = [chunk.start + _length(data, chunk.start) for chunk in walk(map_file(source)).chunks]
    place = rng.randrange(len(data))
    if kind == "cut":
        del data[place:]
        whole = sum(end <= place for end in ends)
    else:
        data[place] ^= 1 << rng.randrange(8)
        whole = sum(not start <= place < end for start, end in zip(starts, ends, strict=True))
    damaged, target = source.with_name("damaged.mcap"), source.with_name("saved.mcap")
    damaged.write_bytes(data)
    target.unlink(missing_ok=True)
    begun = time.perf_counter()
    try:
        recover(damaged, target)
    except RecordError:
        return 0, whole * CHUNK_ROWS, 0, time.perf_counter() - begun
    seconds = time.perf_counter() - begun
    found = read_samples(target if target.exists() else damaged)
    rows = found.sequence.astype(np.int64)
    same = np.ones(len(found), bool)
    for name, column in found.fields.items():
        same &= column.view(f"V{column.itemsize}") == samples[name][rows].view(f"V{column.itemsize}")
    return len(found), whole * CHUNK_ROWS, int((~same).sum()), seconds


def _length(data: bytearray, start: int) -> int:
    """Bytes of the record that begins at `start`."""
    return 9 + int.from_bytes(data[start + 1 : start + 9], "little")


def _kills(folder: Path, kills: int) -> dict[str, Any]:
    results = killed_recordings(kills, folder, SEED)
    lost = [result.lost_s for result in results]
    return {
        "SIGKILL of the recorder: most lost": figure(max(lost), "s", goal=1.0, trials=kills, why=_COUNTED),
        "SIGKILL of the recorder: median lost": figure(statistics.median(lost), "s", why=_COUNTED),
        "SIGKILL of the recorder: false samples": figure(
            sum(result.false for result in results), "samples", goal=0, why=_COUNTED
        ),
    }
