"""`pamrig faults --attacks N`: the emergency stop timed while clients keep the daemon busy."""

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig.app.terminal import console, listing, progress
from rig.cli.common import emit

if TYPE_CHECKING:
    from rig.qualify.faults.attacks import Attack, StopTimes
    from rig.qualify.faults.bench import FaultBench


def attacks(names: Sequence[str], trials: int, seed: int, json_to: str | None) -> None:
    """Each attack (or those `names`), with so many stops; CheckFailed when one took too long or the rig stopped for
    another reason."""
    from rig.errors import CheckFailed
    from rig.qualify.faults.attacks import shortfall, time_stops

    measured: list[StopTimes] = []
    with _bench() as (bench, port):
        for attack in _chosen(names):
            with progress(attack.name, trials) as update:
                measured.append(time_stops(bench, attack, port, trials, seed, update))
    _show(measured, json_to)
    emit({"attacks": [_plain(times) for times in measured], "trials": trials, "seed": seed}, json_to)
    if short := shortfall(measured):
        raise CheckFailed(short)


def _chosen(names: Sequence[str]) -> "list[Attack]":
    from rig.config import suggest
    from rig.errors import RigError
    from rig.qualify.faults.attacks import ATTACKS

    known = [attack.name for attack in ATTACKS]
    if unknown := next((name for name in names if name not in known), None):
        raise RigError(f"no attack {unknown!r}; {suggest(unknown, known)}")
    return [attack for attack in ATTACKS if not names or attack.name in names]


@contextmanager
def _bench() -> "Iterator[tuple[FaultBench, int]]":
    import tempfile

    from rig.qualify.faults.attacks import bench_in, free_port

    port = free_port()
    with (
        tempfile.TemporaryDirectory(prefix="pamrig-") as folder,
        bench_in(Path(folder), port) as bench,
    ):
        yield bench, port


def _show(measured: "list[StopTimes]", json_to: str | None) -> None:
    shown = listing(
        "attack",
        "what is done",
        "stops",
        "p50 ms",
        "p99 ms",
        "95 %",
        "max ms",
        "over goal",
        "p99 once connected",
        "said",
    )
    for times in measured:
        p50, p99, most = (f"{times.quantile(share):.1f}" for share in (0.5, 0.99, 1.0))
        low, high = times.interval_ms(0.99)
        within = f"{low:.1f} to {high:.1f}" if math.isfinite(high) else f"over {low:.1f}"
        figures = [p50, p99, within, most, str(times.late), f"{times.quantile(0.99, connected=True):.1f}"]
        shown.add_row(times.attack.name, times.attack.done, str(len(times.ms)), *figures, times.problem)
    console(json_to).print(shown)


def _plain(times: "StopTimes") -> dict[str, Any]:
    quantiles = {f"{name}_ms": times.quantile(share) for name, share in (("p50", 0.5), ("p99", 0.99), ("max", 1.0))}
    quantiles["connected_p99_ms"] = times.quantile(0.99, connected=True)
    low, high = times.interval_ms(0.99)
    quantiles |= {"p99_low_ms": low, "p99_high_ms": high}
    return {
        "name": times.attack.name,
        "ms": times.ms,
        **quantiles,
        "over_goal": times.late,
        "spoilt": times.spoilt,
        "problem": times.problem,
    }
