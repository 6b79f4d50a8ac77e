"""What a replay does when the rig was stopped, or when somebody was lost."""

from pathlib import Path
from typing import Any

import pytest
from support.records.mcap_files import contents

from rig.app import shipped
from rig.app.runs import replaying, runner
from rig.app.runs.outcome import RunOutcome
from rig.app.runs.replaying import ReplayOptions, prepare, replay_all
from rig.errors import CheckFailed
from rig.realtime.safe_report import Outcome as Reached
from rig.realtime.safe_report import SafeReport, Writer
from rig.service.records.recorder_messages import RunResult
from rig.service.session.session_end import SessionEnd

RECORDINGS = Path(__file__).parents[3] / "replay"


def test_a_rig_that_was_stopped_does_not_move_again_for_the_next_recording(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    calls = []

    def stopped(*given: Any) -> RunOutcome:
        calls.append(given)
        outcome = carry_out(*given)
        outcome.interrupted = True
        return outcome

    carry_out = runner.carry_out
    monkeypatch.setattr(replaying.runner, "carry_out", stopped)
    job = prepare(RECORDINGS, None, None, None, resample=False)
    assert len(job.recordings) > 1
    (done,) = replay_all(job, ReplayOptions(tmp_path))
    assert len(calls) == 1
    assert done.outcome.interrupted


def test_with_the_recorder_lost_the_safe_state_is_told_all_the_same(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    cut = RunResult(1, tmp_path / "x.mcap.part", error="the recorder ended")
    cut.file.write_bytes(b"\x89MCAP0\r\n")
    end = SessionEnd(ticked=True, report=SafeReport(Writer.SUPERVISOR, outcome=Reached.SEEN))
    lost = RunOutcome([cut], 1, error="the rig was stopped: RECORDER_DIED", recorder_lost=True, end=end)
    monkeypatch.setattr(replaying.runner, "carry_out", lambda *_: lost)
    job = prepare(sorted(RECORDINGS.glob("*.mcap"))[0], None, None, None, resample=False)
    with pytest.raises(CheckFailed, match="RECORDER_DIED; safe state written by the supervisor, seen at the device"):
        list(replay_all(job, ReplayOptions(tmp_path / "out")))


def test_a_record_that_could_not_be_written_is_said_and_not_looked_for(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """On a full disk a replay ended with "no such file", of its own record."""
    full = RunResult(1, tmp_path / "x.mcap", error="x.mcap.partial: cannot be written: No space left on device")
    monkeypatch.setattr(replaying.runner, "carry_out", lambda *_: RunOutcome([full], 1))
    job = prepare(sorted(RECORDINGS.glob("*.mcap"))[0], None, None, None, resample=False)
    with pytest.raises(CheckFailed, match=r"not valid: x\.mcap\.partial: cannot be written: No space left"):
        list(replay_all(job, ReplayOptions(tmp_path / "out")))


def test_a_replay_holds_the_model_that_answered_and_not_the_rigs_alone(tmp_path: Path) -> None:
    """It had the rig's own under its name, and nothing of the one that was asked for."""
    model = tmp_path / "simulated.yaml"
    model.write_bytes((shipped.configs() / "models" / "simulated.yaml").read_bytes() + b"# as tuned on Monday\n")
    recording = min(RECORDINGS.glob("*.mcap"), key=lambda path: path.stat().st_size)
    (done,) = replay_all(prepare(recording, None, model, None, resample=False), ReplayOptions(tmp_path / "out"))
    held = contents(done.file).attachments
    assert held["simulated.yaml"] == model.read_bytes()
    assert held["simulated_2.yaml"] == (shipped.configs() / "models" / "simulated.yaml").read_bytes()
    assert {"rig.yaml"} < held.keys()


def test_one_replay_goes_into_the_file_that_was_named(tmp_path: Path) -> None:
    job = prepare(sorted(RECORDINGS.glob("*.mcap"))[0], None, None, None, resample=False)
    (done,) = replay_all(job, ReplayOptions(tmp_path / "again.MCAP", clock="virtual"))
    assert (tmp_path / "again.MCAP").is_file()
    assert done.file == tmp_path / "again.MCAP"
