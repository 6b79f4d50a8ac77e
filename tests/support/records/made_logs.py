"""Logs made by hand for tests: what a run of the rig leaves, without a rig."""

from pathlib import Path

import numpy as np

from rig.log.convert import LogContent, write_content
from rig.log.mcap.collector import LogLine
from rig.log.mcap.columns import DTYPES, Samples
from rig.sample import WIRES, Flag, Phase

PERIOD_NS = 5_000_000
STARTED_NS = 1_790_000_000_000_000_000
BOOT_NS = 123_456_789_000


def made_samples(count: int, seed: int = 1, missed_at: int | None = None) -> Samples:
    """A sine with settle, zero, ramp in and ramp out of `count` ticks; before tick `missed_at` two periods are
    missed."""
    rng = np.random.default_rng(seed)
    tick = np.arange(count, dtype=np.int64)
    missed = np.zeros(count, np.uint32)
    if missed_at is not None:
        tick[missed_at:] += 2
        missed[missed_at] = 2
    scheduled = BOOT_NS + tick * PERIOD_NS
    woken = scheduled + rng.integers(8_000, 30_000, count)
    read = woken + rng.integers(60_000, 90_000, count)
    phase = np.select(
        [tick < count * 0.1, tick < count * 0.15, tick < count * 0.2, tick < count * 0.9],
        [Phase.SETTLE, Phase.ZERO, Phase.RAMP_IN, Phase.SWEEP],
        Phase.RAMP_OUT,
    )
    dp = np.where(phase == Phase.SWEEP, 0.2 * np.sin(np.pi * (tick - count * 0.2) * 0.005), 0.0)
    counts = {name: np.rint(rng.normal(2000, 300, count)) for name in ("p1_raw", "p2_raw", "angle_raw")}
    columns = {
        "tick": tick,
        "scheduled_ns": scheduled,
        "woken_ns": woken,
        "read_ns": read,
        "written_ns": read + 40_000,
        "missed": missed,
        "dp_cmd_mpa": dp,
        "p1_cmd_mpa": 0.2 + dp / 2,
        "p2_cmd_mpa": 0.2 - dp / 2,
        "p1_mpa": 0.2 + dp / 2 + rng.normal(0, 0.001, count),
        "p2_mpa": 0.2 - dp / 2 + rng.normal(0, 0.001, count),
        "angle_deg": 180 * dp + rng.normal(0, 0.05, count),
        **counts,
        "excitation_raw": np.full(count, np.nan),
        "run": 1,
        "state": 2,
        "phase": phase,
        "flags": np.where(phase > Phase.ZERO, int(Flag.ANGLE_ZEROED), 0),
        "angle_zero_deg": np.where(phase > Phase.ZERO, 1.25, 0.0),
    }
    fields = {
        name: np.broadcast_to(columns.get(name, 0), count).astype(DTYPES[wire.kind]) for name, wire in WIRES.items()
    }
    return Samples(fields, scheduled - BOOT_NS + STARTED_NS, np.arange(count, dtype=np.uint32))


def made_content(count: int = 1000, seed: int = 1, missed_at: int | None = None) -> LogContent:
    """The whole log of such a run, with facts of every kind, attachments and log lines."""
    samples = made_samples(count, seed, missed_at)
    missed = int(samples["missed"].sum())
    run = {
        "name": "sine_0.5hz_0.20mpa",
        "session": "12e4",  # text that looks like a number must stay text
        "period_ns": PERIOD_NS,
        "started_ns": STARTED_NS,
        "p0_mpa": 0.2,
        "signal": "sine",
        "device": {"serial": "0x1A", "range": [0.0, 0.5]},
        "operator": "Đào",
    }
    result = {"valid": missed == 0, "ticks": count, "records": count, "missed": missed, "dropped": 0, "fault": ""}
    attachments = {"sweep.yaml": b"name: made\n", "photo.bin": bytes(range(256))}
    times = samples.log_time_ns
    lines = (
        LogLine(int(times[0]), "info", "begun"),
        LogLine(int(times[-1]), "warning", 'a \N{DEGREE SIGN} sign, a " and a \n'),
    )
    return LogContent(samples, run, result, attachments, lines)


def made_log(path: Path, count: int = 1000, seed: int = 1, missed_at: int | None = None) -> LogContent:
    """That log as a file; returns what is in it."""
    content = made_content(count, seed, missed_at)
    write_content(content, path)
    return content


def assert_same_samples(found: Samples, wanted: Samples) -> None:
    """Every field of every tick, bit by bit."""
    assert len(found) == len(wanted)
    assert np.array_equal(found.log_time_ns, wanted.log_time_ns)
    assert np.array_equal(found.sequence, wanted.sequence)
    for name in WIRES:
        assert found[name].dtype == wanted[name].dtype, name
        assert found[name].tobytes() == wanted[name].tobytes(), name


def assert_same_content(found: LogContent, wanted: LogContent) -> None:
    """Samples, facts, attachments and log lines."""
    assert_same_samples(found.samples, wanted.samples)
    assert dict(found.run_facts) == dict(wanted.run_facts)
    assert dict(found.result_facts) == dict(wanted.result_facts)
    assert dict(found.attachments) == dict(wanted.attachments)
    assert found.lines == wanted.lines
