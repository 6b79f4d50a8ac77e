"""The recorder: which samples go into which file, what it says of them, and what it does when the disk or the loop
fails."""

import multiprocessing
import os
import secrets
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from support.records.mcap_files import contents
from support.scripted import PERIOD_NS

from rig.errors import RecordError
from rig.log.check import check
from rig.log.mcap.schema import Ended
from rig.log.mcap.writer import RunWriter
from rig.realtime.faults import Fault
from rig.realtime.ring import Ring, RingWriter
from rig.realtime.state import State
from rig.sample import WIRES, Flag, Phase, Sample
from rig.service.records import open_run
from rig.service.records.recorder import Recorder
from rig.service.records.recorder_messages import RecorderTrouble, RunOrder, RunResult

WALL_NS = 1_700_000_000_000_000_000


@pytest.fixture
def ring() -> Iterator[Ring]:
    made = Ring.create(f"test-{secrets.token_hex(8)}", 5, capacity=4096)
    yield made
    made.block.unlink()


def sample(tick: int, run: int, phase: Phase = Phase.SWEEP, **more: float) -> Sample:
    due_ns = tick * PERIOD_NS
    values = dict.fromkeys(WIRES, 0) | {
        "tick": tick,
        "run": run,
        "phase": phase,
        "scheduled_ns": due_ns,
        "woken_ns": due_ns + 7_000,
    }
    return Sample(**(values | {"state": State.RUNNING} | more))  # type: ignore[arg-type]


def order(folder: Path, run: int = 1, sweep_ticks: int = 10) -> RunOrder:
    facts = {"name": f"run{run}", "period_ns": PERIOD_NS, "started_ns": WALL_NS}
    return RunOrder(run, folder / f"run{run}.mcap", facts, {"rig.yaml": b"name: x\n"}, sweep_ticks, WALL_NS)


def recorded(
    ring: Ring, samples: list[Sample], *orders: RunOrder | Fault, troubles: list[RecorderTrouble] | None = None
) -> list[RunResult]:
    """What a recorder makes of `samples`, which are in the ring before it begins."""
    writer = RingWriter(ring)
    for item in samples:
        writer.put(item)
    orders_in, orders_out = multiprocessing.Pipe(duplex=False)
    results_in, results_out = multiprocessing.Pipe(duplex=False)
    for item in (*orders, None):
        orders_out.send(item)
    Recorder(ring, orders_in, results_out).run()
    results_out.close()
    found = []
    while True:
        try:
            found.append(results_in.recv())
        except EOFError:
            return [
                word
                for word in found
                if not (isinstance(word, RecorderTrouble) and (troubles is None or troubles.append(word) is None))
            ]


def test_a_run_goes_into_its_file_as_it_is(ring: Ring, tmp_path: Path) -> None:
    mine = (
        [sample(t, 1, Phase.SETTLE) for t in range(3)]
        + [sample(t, 1) for t in range(3, 13)]
        + [sample(13, 1, Phase.NONE)]
    )
    (result,) = recorded(ring, [*mine, sample(14, 0, Phase.NONE)], order(tmp_path))
    assert result == RunResult(1, tmp_path / "run1.mcap", ticks=14, valid=True, complete=True, cpu_s=result.cpu_s,
                               lateness_us={"p50": 7.0, "p99": 7.0, "max": 7.0})  # fmt: skip
    file = contents(result.file)
    assert file.samples == mine
    assert file.log_times_ns == [s.scheduled_ns + WALL_NS for s in mine]
    assert file.attachments == {"rig.yaml": b"name: x\n"}
    assert file.run["name"] == "run1"
    assert (file.result["valid"], file.result["ticks"], file.result["missed"], file.result["dropped"]) == (
        "true",
        "14",
        "0",
        "0",
    )
    assert not list(tmp_path.glob("*.partial"))


def test_each_run_gets_its_own_file_and_what_was_not_ordered_none(ring: Ring, tmp_path: Path) -> None:
    samples = [sample(t, run, Phase.NONE) for t, run in enumerate([0, 1, 1, 0, 2, 2, 2, 3, 3, 0])]
    results = recorded(ring, samples, order(tmp_path, 1), order(tmp_path, 2))
    assert [(r.run, r.ticks) for r in results] == [(1, 2), (2, 3)]
    assert sorted(p.name for p in tmp_path.iterdir()) == ["run1.mcap", "run2.mcap"]


def test_missed_ticks_make_it_invalid_and_count_as_lateness(ring: Ring, tmp_path: Path) -> None:
    samples = [sample(0, 1), sample(4, 1, missed=3), sample(5, 1, Phase.NONE), sample(6, 0)]
    (result,) = recorded(ring, samples, order(tmp_path, sweep_ticks=5))
    assert (result.missed, result.valid, result.complete) == (3, False, True)
    assert result.lateness_us["max"] == 7.0 + 3 * 5000.0
    file = contents(result.file)
    assert file.result["valid"] == "false"
    assert "3 ticks missed before tick 4" in file.lines


def test_ticks_that_were_missed_before_the_sweep_are_none_of_it(ring: Ring, tmp_path: Path) -> None:
    """A sweep of ten ticks that somebody stopped after three, on a machine that stood still while the rig settled."""
    samples = [sample(0, 1, Phase.SETTLE), sample(9, 1, Phase.SETTLE, missed=8), sample(10, 1, Phase.RAMP_IN)]
    samples += [sample(t, 1) for t in range(11, 14)] + [sample(14, 1, Phase.RAMP_OUT), sample(15, 1, Phase.NONE)]
    (result,) = recorded(ring, samples, order(tmp_path, sweep_ticks=10))
    assert (result.missed, result.complete, result.ended) == (8, False, Ended.STOPPED)
    assert contents(result.file).result["ended"] == "stopped"


@pytest.mark.parametrize("where", [(2, Phase.RAMP_IN), (6, Phase.SWEEP), (10, Phase.SWEEP)])
def test_ticks_that_were_missed_at_either_end_of_the_sweep_are_of_it(
    ring: Ring, tmp_path: Path, where: tuple[int, Phase]
) -> None:
    """Skipped: the tick behind the one that is named; phases 2 ramp in, 3 to 10 sweep, 11 ramp out."""
    before, phase = where
    phases = [Phase.SETTLE] * 2 + [Phase.RAMP_IN] + [Phase.SWEEP] * 8 + [Phase.RAMP_OUT] * 3 + [Phase.NONE]
    assert phases[before] is phase
    samples = [sample(t, 1, each, missed=int(t == before + 2)) for t, each in enumerate(phases) if t != before + 1]
    (result,) = recorded(ring, samples, order(tmp_path, sweep_ticks=8))
    assert (result.missed, result.complete, result.valid) == (1, True, False)


def test_overwritten_samples_are_counted_as_dropped(ring: Ring, tmp_path: Path) -> None:
    before = [sample(t, 0) for t in range(10)]
    mine = [sample(t, 1) for t in range(10, 5000)]
    (result,) = recorded(ring, [*before, *mine, sample(5000, 0)], order(tmp_path, sweep_ticks=4990))
    assert result.ticks == 4095
    assert not result.valid, "its beginning is gone"
    assert result.dropped + result.ticks == len(before) + len(mine), "whose they were nobody can say: all count"


def test_a_fault_is_in_the_file_with_its_cause(ring: Ring, tmp_path: Path) -> None:
    samples = [sample(0, 1), sample(1, 1, Phase.NONE, fault=Fault.FROZEN_SENSOR, state=State.FAULT), sample(2, 0)]
    (result,) = recorded(ring, samples, order(tmp_path))
    assert (result.fault, result.valid, result.complete) == (Fault.FROZEN_SENSOR, False, False)
    file = contents(result.file)
    assert any(line.startswith("FROZEN_SENSOR: a sensor repeats") for line in file.lines)
    assert file.result["fault"].startswith("FROZEN_SENSOR")


def test_what_is_special_is_told_once_when_it_appears(ring: Ring, tmp_path: Path) -> None:
    flags = [0, Flag.CLIPPED_SLEW, Flag.CLIPPED_SLEW, 0, Flag.CLIPPED_SLEW | Flag.STALE]
    samples = [sample(t, 1, flags=int(f)) for t, f in enumerate(flags)]
    (result,) = recorded(ring, [*samples, sample(9, 0)], order(tmp_path))
    lines = [line for line in contents(result.file).lines if "CLIPPED" in line or "STALE" in line]
    assert lines == ["CLIPPED_SLEW at tick 1", "CLIPPED_SLEW at tick 4"]


def test_a_stop_of_the_operator_leaves_a_record_that_is_stopped_and_no_measurement(ring: Ring, tmp_path: Path) -> None:
    samples = [sample(0, 1), sample(1, 1, Phase.RAMP_OUT), sample(2, 1, Phase.NONE), sample(3, 0)]
    (result,) = recorded(ring, samples, order(tmp_path))
    assert (result.valid, result.complete, result.ended) == (False, False, Ended.STOPPED)
    file = contents(result.file)
    assert (file.result["valid"], file.result["ended"]) == ("false", "stopped")
    assert check(result.file)[0] == "the run was stopped before its sweep was over"


@pytest.mark.parametrize(("fault", "ended"), [(0, Ended.COMPLETE), (Fault.ANGLE_LIMIT, Ended.FAULT)])
def test_complete_and_faulted_are_different_things(ring: Ring, tmp_path: Path, fault: int, ended: Ended) -> None:
    samples = [*[sample(t, 1) for t in range(10)], sample(10, 1, Phase.NONE, fault=fault), sample(11, 0)]
    (result,) = recorded(ring, samples, order(tmp_path))
    assert (result.ended, result.valid) == (ended, ended is Ended.COMPLETE)
    assert contents(result.file).result["ended"] == str(ended)


def test_a_folder_that_is_deleted_under_a_record_is_said_at_once(
    ring: Ring, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(open_run, "FLUSH_NS", 0)
    flush, calls = RunWriter.flush, [0]

    def flushing(self: RunWriter) -> None:
        calls[0] += 1
        if calls[0] == 3:
            shutil.rmtree(tmp_path / "logs")
        flush(self)

    monkeypatch.setattr(RunWriter, "flush", flushing)
    (tmp_path / "logs").mkdir()
    troubles: list[RecorderTrouble] = []
    (result,) = recorded(
        ring, [*(sample(t, 1) for t in range(2000)), sample(2000, 0)], order(tmp_path / "logs"), troubles=troubles
    )
    said = f"{tmp_path}/logs/run1.mcap.partial: was deleted or moved while it was being written"
    assert troubles[-1] == RecorderTrouble(1, said, final=True), "while the run went on"
    assert not result.valid
    assert result.error


def test_a_full_disk_is_said_at_once_and_again_when_it_has_room(
    ring: Ring, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(open_run, "FLUSH_NS", 0)
    write, calls = os.write, [0]

    def refusing(fd: int, data: bytes) -> int:
        calls[0] += 1
        if 2 <= calls[0] <= 3:
            raise OSError(28, "No space left on device")
        return write(fd, data)

    monkeypatch.setattr(os, "write", refusing)
    troubles: list[RecorderTrouble] = []
    samples = [*(sample(t, 1) for t in range(2000)), sample(2000, 1, Phase.NONE), sample(2001, 0)]
    (result,) = recorded(ring, samples, order(tmp_path), troubles=troubles)
    assert result.valid
    assert not any(trouble.final for trouble in troubles)
    assert any("No space left" in trouble.error for trouble in troubles)
    assert troubles[-1].error == ""


def test_a_record_that_ends_in_the_middle_is_not_valid(ring: Ring, tmp_path: Path) -> None:
    (result,) = recorded(ring, [sample(t, 1) for t in range(20)], order(tmp_path))
    assert (result.valid, result.fault, result.ticks) == (False, Fault.LOOP_DIED, 20)
    assert any(line.startswith("LOOP_DIED") for line in contents(result.file).lines)


def test_a_record_is_cut_by_what_the_end_of_the_loop_is_called(ring: Ring, tmp_path: Path) -> None:
    (result,) = recorded(ring, [sample(t, 1) for t in range(20)], order(tmp_path), Fault.LONG_STALL)
    assert (result.valid, result.fault, result.ticks) == (False, Fault.LONG_STALL, 20)
    assert any(line.startswith("LONG_STALL") for line in contents(result.file).lines)


def test_the_last_record_may_end_with_the_session(ring: Ring, tmp_path: Path) -> None:
    (result,) = recorded(ring, [*[sample(t, 1) for t in range(10)], sample(10, 1, Phase.NONE)], order(tmp_path))
    assert (result.valid, result.fault) == (True, Fault.NONE)


def test_an_existing_file_is_never_overwritten(ring: Ring, tmp_path: Path) -> None:
    (tmp_path / "run1.mcap").write_text("precious")
    (result,) = recorded(ring, [sample(0, 1), sample(1, 1), sample(2, 0)], order(tmp_path))
    assert (tmp_path / "run1.mcap").read_text() == "precious"
    assert "exists already" in result.error
    assert (result.valid, result.ticks, result.dropped) == (False, 2, 2)


def test_a_folder_that_is_gone_does_not_end_the_counting(ring: Ring, tmp_path: Path) -> None:
    (result,) = recorded(ring, [sample(0, 1), sample(1, 0)], order(tmp_path / "gone"))
    assert (result.valid, result.dropped) == (False, 1)
    assert "No such file" in result.error


def test_a_disk_that_fills_up_leaves_what_was_written_and_says_so(
    ring: Ring, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    room = [6000]
    write = os.write

    def limited(fd: int, data: bytes) -> int:
        if room[0] <= 0:
            raise OSError(28, "No space left on device")
        count = write(fd, data[: room[0]])
        room[0] -= count
        return count

    monkeypatch.setattr(os, "write", limited)
    (result,) = recorded(ring, [sample(t, 1) for t in range(3000)] + [sample(3000, 0)], order(tmp_path))
    assert not result.valid
    assert result.error == f"{tmp_path}/run1.mcap.partial: cannot be written: No space left on device"
    assert result.file == tmp_path / "run1.mcap.partial"
    assert result.file.stat().st_size == 6000
    assert 0 < result.dropped <= result.ticks == 3000


def test_a_disk_that_gets_room_again_loses_nothing(ring: Ring, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(open_run, "FLUSH_NS", 0)
    write, calls = os.write, [0]

    def refusing(fd: int, data: bytes) -> int:
        calls[0] += 1
        if 2 <= calls[0] <= 5:
            raise OSError(28, "No space left on device")
        return write(fd, data)

    monkeypatch.setattr(os, "write", refusing)
    samples = [sample(t, 1) for t in range(2000)]
    (result,) = recorded(ring, [*samples, sample(2000, 0)], order(tmp_path))
    assert calls[0] > 5
    assert (result.valid, result.dropped) == (True, 0)
    assert contents(result.file).samples == samples


def test_a_disk_that_gets_room_at_the_last_moment_makes_a_whole_record(
    ring: Ring, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was called an error all the same: its queue stopped, and the daemon did not know the record as its own."""

    begun = [False]

    def full(_: RunWriter) -> None:
        if begun[0]:
            raise RecordError("No space left on device")
        begun[0] = True

    monkeypatch.setattr(open_run, "FLUSH_NS", 0)
    monkeypatch.setattr(RunWriter, "flush", full)
    (result,) = recorded(ring, [*(sample(t, 1) for t in range(2000)), sample(2000, 0)], order(tmp_path))
    assert (result.valid, result.dropped, result.error) == (True, 0, "")


def test_orders_that_break_off_end_the_recorder(ring: Ring, tmp_path: Path) -> None:
    for item in [sample(t, 1) for t in range(5)]:
        RingWriter(ring).put(item)
    orders_in, orders_out = multiprocessing.Pipe(duplex=False)
    _results_in, results_out = multiprocessing.Pipe(duplex=False)
    orders_out.send(order(tmp_path))
    orders_out.close()
    Recorder(ring, orders_in, results_out).run()
    assert (tmp_path / "run1.mcap").exists(), "the file is finished although nobody listens any more"
