"""One row of the fault table carried out: do it, time it, and look for the cause and the evidence."""

import contextlib
import os
import signal
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from rig.errors import RigError
from rig.log.mcap.writer import PARTIAL_SUFFIX
from rig.number_text import counted
from rig.qualify.faults.bench import BY_THE_MACHINE, FaultBench, Spoilt
from rig.qualify.faults.table import FaultRow
from rig.realtime.faults import Fault

ATTEMPTS: Final = 4
"""A trial is repeated when the machine itself stood still, which a virtual one does now and then."""
_FINISH_S: Final = 2.0
_UNFINISHED_OR_NOT: Final = (".mcap", f".mcap{PARTIAL_SUFFIX}")


@dataclass(frozen=True)
class Finding:
    """What was seen; `problem` is empty when all was as the table says."""

    row: FaultRow
    cause: str = ""
    ms: float | None = None
    evidence: str = ""
    problem: str = ""


def try_row(bench: FaultBench, row: FaultRow) -> Finding:
    """Carry out `row`; again when something else got in the way, or a bound was missed that a standing machine
    explains."""
    finding = Finding(row, problem="not tried")
    for _ in range(ATTEMPTS):
        try:
            bench.ready()
            seen = _Seen(bench)
            since_ns = row.act(bench)
            finding = _stopped(bench, row, seen, since_ns) if row.causes else _unmoved(bench, row, seen)
        except Spoilt as error:
            finding = Finding(row, problem=f"spoilt: {error}")
            continue
        except RigError as error:
            finding = Finding(row, problem=str(error))
        if not finding.problem:
            break
    return finding


class _Seen:
    """How things stood before the fault."""

    def __init__(self, bench: FaultBench) -> None:
        status = bench.status()
        self.log_chars = len(bench.log_text())
        self.missed = status["loop"]["missed"]
        self.black_boxes = _black_boxes(bench)


def _black_boxes(bench: FaultBench) -> set[Path]:
    return set((bench.state / "blackbox").glob("*.mcap"))


def _unmoved(bench: FaultBench, row: FaultRow, seen: _Seen) -> Finding:
    """The rig must go on as if nothing had been."""
    time.sleep(0.1)
    cause = bench.fault()
    if cause in BY_THE_MACHINE:
        raise Spoilt(cause)
    missed = bench.status()["loop"]["missed"] - seen.missed
    log = bench.log_text()[seen.log_chars :]
    problem = (
        f"the rig stopped: {cause}" if cause else "" if row.in_log in log else f"the log does not say {row.in_log!r}"
    )
    return Finding(row, cause, None, f"{counted(missed, 'period')} skipped" if missed else "on the grid", problem)


def _stopped(bench: FaultBench, row: FaultRow, seen: _Seen, since_ns: int) -> Finding:
    """The rig must reach its safe state, for the right reason, in time, and leave its evidence."""
    ms = bench.ms_to_safe(since_ns)
    if row.control_dies:
        cause = _cause_found_later(bench)
    else:
        with contextlib.suppress(ProcessLookupError):
            os.kill(bench.daemon_pid, signal.SIGCONT)
        cause = bench.wait(bench.fault, "the fault to be reported")
        bench.wait(lambda: _black_boxes(bench) - seen.black_boxes, "the black box")
    if cause not in row.causes and cause in BY_THE_MACHINE:
        raise Spoilt(cause)
    log = bench.log_text()[seen.log_chars :]
    boxes = _black_boxes(bench) - seen.black_boxes
    evidence = ", ".join(
        [
            *(f"black box of {counted(_samples(box), 'sample')}" for box in boxes),
            *_records(bench, cause == Fault.RECORDER_DIED.name),
        ]
    )
    return Finding(row, cause, ms, evidence, _problem(row, cause, ms, log, evidence))


def _problem(row: FaultRow, cause: str, ms: float, log: str, evidence: str) -> str:
    if cause not in row.causes:
        return f"the cause is given as {cause or 'none'}, not {' or '.join(row.causes)}"
    if row.in_log not in log:
        return f"the log does not say {row.in_log!r}"
    if ms > row.bound_ms:
        return f"{ms:.1f} ms to the safe state; the bound is {row.bound_ms:g} ms"
    return "" if evidence else "no evidence was kept"


def _cause_found_later(bench: FaultBench) -> str:
    """With the control process gone, what the record says; then a new daemon must come up disarmed."""
    bench.wait(lambda: not bench.alive, "the control process to end")
    records: list[Path] = bench.wait(lambda: sorted(bench.logs.rglob("*.mcap"), key=_age), "the record to be finished")
    bench.end()
    bench.start()
    status = bench.status()
    if status["state"] != "disarmed":
        return f"(state {status['state']} after the restart)"
    return _fault_of(records[0])


def _age(path: Path) -> float:
    return -path.stat().st_mtime


def _records(bench: FaultBench, recorder_lost: bool) -> list[str]:
    """The newest record of the folder: finished by the recorder, or cut where that one is lost."""
    deadline = time.monotonic() + _FINISH_S
    while True:
        with contextlib.suppress(FileNotFoundError):  # it has its last name by now: look again
            names = (path for path in bench.logs.rglob("*.mcap*") if path.name.endswith(_UNFINISHED_OR_NOT))
            newest = min(names, key=_age, default=None)
            if newest is None:
                return []
            cut = newest.suffix == PARTIAL_SUFFIX
            if not cut or recorder_lost or time.monotonic() > deadline:
                return [f"{'cut ' if cut else ''}record of {counted(_samples(newest), 'sample')}"]
        time.sleep(0.01)


def _samples(path: Path) -> int:
    """How many samples can be read from a log, cut or whole."""
    return sum(1 for _ in _messages(path))


def _fault_of(path: Path) -> str:
    """Name of the fault in the last sample of a record."""
    from rig.sample import unpack

    packed = list(_messages(path))
    return Fault(unpack(packed[-1]).fault).name if packed else ""


def _messages(path: Path) -> Any:
    from mcap.exceptions import McapError
    from mcap.records import Message
    from mcap.stream_reader import StreamReader

    from rig.sample import SAMPLE_BYTES

    with path.open("rb") as file, contextlib.suppress(McapError, EOFError):
        for record in StreamReader(file).records:
            if isinstance(record, Message) and len(record.data) == SAMPLE_BYTES:
                yield record.data
