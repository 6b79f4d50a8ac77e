"""A file that the disk does not take: what was found is said all the same, and then which file it was."""

import errno
import os
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from click.testing import CliRunner, Result
from support.records.made_logs import made_log

from rig.app import compose
from rig.app.gap import calibrating
from rig.app.gap.campaign import Campaign
from rig.app.gap.hunt import hunting, report
from rig.app.gap.hunt.folder import Hunt, HuntStep
from rig.app.gap.hunt.options import HuntOptions
from rig.app.runs import replaying, sweeping, tracking
from rig.app.runs.outcome import RunOutcome
from rig.cli.commands import cli
from rig.errors import CheckFailed, Interrupted, RecordError, RigError
from rig.gap import diagnosis as diagnosing
from rig.gap.answer.facts import Gap, Verdict, Where
from rig.gap.answer.how_far import augment
from rig.gap.answer.result import Diagnosis
from rig.gap.priors import fitted
from rig.realtime.faults import Fault
from rig.report import fit_files, gap_page
from rig.service.records.recorder_messages import RunResult

MODEL = "configs/models/simulated.yaml"
NO_ROOM = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
FOUND = Diagnosis(Verdict.NONE, 0.9, Gap(0.2, 0.2, 5.0, 0.0, 0.2, 0.2, 0.3, "sessions", 0.2), Where(None), [], [], None)


def run(*words: object) -> Result:
    return CliRunner().invoke(cli, [str(word) for word in words])


def full(*_: object, **__: object) -> Any:
    raise NO_ROOM


def identified(place: Path, *more: object) -> Result:
    """A search that takes no time, on the record in `place`, with its model and what else is asked for beside it."""
    quick = ("--seeds", "1", "--particles", "4", "--iterations", "3", "--no-polish", "--unbounded")
    return run("identify", place / "rec.mcap", "-o", place / "m.yaml", *more, *quick)


def test_what_was_identified_is_said_where_the_model_cannot_be_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Half a minute of searching ended in the line alone."""
    made_log(tmp_path / "rec.mcap")
    monkeypatch.setattr(os, "fsync", full)
    done = identified(tmp_path)
    assert str(done.exception) == f"{tmp_path / 'm.yaml'}: cannot be written: No space left on device"
    assert "RMSE" in done.output
    assert "model:" not in done.output
    assert [path.name for path in tmp_path.iterdir()] == ["rec.mcap"]


@pytest.mark.parametrize("lost", ["page", "json"])
def test_what_was_diagnosed_is_said_where_a_file_cannot_be_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, lost: str
) -> None:
    made_log(tmp_path / "rec.mcap")
    monkeypatch.setattr(diagnosing, "diagnose_with_grounds", lambda *_, **__: (FOUND, None))

    def no_page(path: Path, *_: object) -> None:
        raise RigError(f"{path}: cannot be written: No space left on device")

    monkeypatch.setattr(gap_page, "write_page", no_page)
    if lost == "json":
        monkeypatch.setattr(os, "fsync", full)
    place = tmp_path / ("gap.html" if lost == "page" else "gap.json")
    more = ("--html", place, "--json", tmp_path / "gap.json") if lost == "page" else ("--json", place)
    done = run("gap", "diagnose", "--model", MODEL, "--log", tmp_path / "rec.mcap", *more)
    assert str(done.exception) == f"{place}: cannot be written: No space left on device"
    assert "Answer:" in done.output
    assert (tmp_path / "gap.json").exists() == (lost == "page")


def no_place(*_: object) -> None:
    raise RigError("cannot be written: No space left on device")


def test_a_model_is_told_as_json_where_its_figures_cannot_be_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first file that a disk did not take was the last that was written."""
    made_log(tmp_path / "rec.mcap")
    monkeypatch.setattr(fit_files, "write_fit_figures", no_place)
    done = identified(tmp_path, "--figures", tmp_path / "figures", "--json", tmp_path / "m.json")
    assert str(done.exception) == "cannot be written: No space left on device"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["m.json", "m.yaml", "rec.mcap"]


def test_gains_are_told_as_json_where_the_reference_cannot_be_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tracking, "write_gains", no_place)
    files = ("--tracking", "tracking", "-o", tmp_path / "tuned.yaml", "--json", tmp_path / "tuned.json")
    done = run("tune", "--model", MODEL, *files)
    assert str(done.exception) == "cannot be written: No space left on device"
    assert [path.name for path in tmp_path.iterdir()] == ["tuned.json"]


def test_levels_are_told_as_json_where_their_file_cannot_be_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Hours of fitting ended in the line alone."""
    monkeypatch.setattr(calibrating, "calibrate", lambda *_: fitted())
    monkeypatch.setattr(calibrating, "write", no_place)
    done = run("gap", "calibrate", "-o", tmp_path / "levels.yaml", "--json", tmp_path / "levels.json")
    assert str(done.exception) == "cannot be written: No space left on device"
    assert [path.name for path in tmp_path.iterdir()] == ["levels.json"]


def test_the_simulator_with_the_causes_is_written_where_the_page_cannot_be(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made_log(tmp_path / "rec.mcap")
    grounds = SimpleNamespace(expected=None)
    monkeypatch.setattr(diagnosing, "diagnose_with_grounds", lambda *_, **__: (FOUND, grounds))
    monkeypatch.setattr(gap_page, "write_page", no_place)
    monkeypatch.setattr(augment, "augmented", lambda model, *_: model)
    files = ("--html", tmp_path / "gap.html", "--augmented-model", tmp_path / "m.yaml")
    done = run("gap", "diagnose", "--model", MODEL, "--log", tmp_path / "rec.mcap", *files)
    assert str(done.exception) == "cannot be written: No space left on device"
    assert (tmp_path / "m.yaml").exists()


FAULTY = RunOutcome([RunResult(1, Path("sine.mcap"), ticks=9, fault=Fault.NOT_FOLLOWING)], 1)
STOPPED = RunOutcome([], 1, interrupted=True)
NO_JSON = "/dev/full: cannot be written: No space left on device"


@pytest.mark.parametrize(("came", "kind", "begins"), [
    (FAULTY, CheckFailed, "sine.mcap: NOT_FOLLOWING"), (STOPPED, Interrupted, "interrupted"),
    (RunOutcome([], 0), RigError, ""),
])  # fmt: skip
def test_what_became_of_the_rig_is_told_where_its_result_cannot_be_written(
    monkeypatch: pytest.MonkeyPatch, came: RunOutcome, kind: type[Exception], begins: str
) -> None:
    """The disk's error hid the fault, and with it the exit status 1."""
    monkeypatch.setattr(sweeping, "run_sweep", lambda *_: came)
    error = run("run", "quick", "--clock", "virtual", "--json", "/dev/full").exception
    assert type(error) is kind
    assert str(error).startswith(begins)
    assert str(error).endswith(NO_JSON)


def test_a_check_that_fails_says_so_where_its_result_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "cut.mcap").write_bytes(b"no log")
    error = run("log", "check", tmp_path / "cut.mcap", "--json", "/dev/full").exception
    assert str(error) == f"1 of 1 log not in order; {NO_JSON}"
    assert type(error) is CheckFailed


def test_a_fault_in_a_replay_is_told_where_the_comparison_cannot_be_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recording = min(Path("tests/replay").glob("*.mcap"), key=lambda path: path.stat().st_size)

    def faulty(*given: Any) -> RunOutcome:
        outcome = carry_out(*given)
        outcome.runs[0].fault = Fault.NOT_FOLLOWING
        return outcome

    def refused(*_: object) -> None:
        raise RecordError("out.mcap: cannot be written: No space left on device")

    carry_out = replaying.runner.carry_out
    monkeypatch.setattr(replaying.runner, "carry_out", faulty)
    monkeypatch.setattr(replaying, "write_content", refused)
    error = run("replay", recording, "-o", tmp_path).exception
    assert type(error) is CheckFailed
    assert "NOT_FOLLOWING" in str(error)
    assert "No space left on device; the replay itself is whole and stays at" in str(error)


def test_a_campaign_says_of_which_days_a_file_is_missing() -> None:
    no_room = "day_tuesday.html: cannot be written: No space left on device"
    campaign = Campaign({"monday": FOUND, "tuesday": FOUND}, {"friday": "no angle"}, [no_room])
    with pytest.raises(RigError, match=f"^1 of 3 days could not be diagnosed: friday: no angle; {no_room}$"):
        campaign.complain()
    Campaign({"monday": FOUND}, {}, []).complain()


def a_hunt(folder: Path) -> HuntOptions:
    return HuntOptions(compose.load(Path("simulated_worn")), Path(MODEL), folder, virtual=True)


def test_what_a_hunt_has_learnt_is_said_where_its_notes_cannot_be_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The thought after the last sweep was lost with them."""
    asked = a_hunt(tmp_path)
    Hunt(tmp_path, asked.asked, (HuntStep("step_1.yaml", "first", 1.0, "step_1_records"),)).save()
    thought = SimpleNamespace(names=(("delay", 0.97),), settled="named", diagnosis=FOUND, grounds=None)

    def refused(_: Hunt) -> None:
        raise RigError("hunt.json: cannot be written: No space left on device")

    monkeypatch.setattr(hunting, "diagnose_so_far", lambda *_: thought)
    monkeypatch.setattr(report, "write_page", full)
    monkeypatch.setattr(Hunt, "save", refused)
    heard: list[HuntStep] = []
    told: list[hunting.Hunted] = []
    with pytest.raises(RigError, match=r"hunt\.json: cannot be written"):
        report.hunt_and_tell(asked, lambda _: True, heard.append, told.append)
    assert [step.set for step in heard] == [(("delay", 0.97),)]
    assert [one.finding for one in told] == [thought]


def test_the_end_of_a_hunt_is_said_where_its_page_cannot_be_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found, told = hunting.Hunted(Hunt(tmp_path), None), []
    monkeypatch.setattr(report, "hunt", lambda *_: found)
    monkeypatch.setattr(report, "write_hunt", full)
    with pytest.raises(OSError, match="No space left"):
        report.hunt_and_tell(a_hunt(tmp_path), lambda _: True, lambda _: None, told.append)
    assert told == [found]


def test_a_replay_that_cannot_be_compared_on_the_disk_is_said_to_be_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recording = min(Path("tests/replay").glob("*.mcap"), key=lambda path: path.stat().st_size)

    def refused(*_: object) -> None:
        raise RecordError("out.mcap: cannot be written: No space left on device")

    monkeypatch.setattr(replaying, "write_content", refused)
    done = run("replay", recording, "-o", tmp_path)
    (left,) = tmp_path.iterdir()
    assert str(done.exception).endswith(f"No space left on device; the replay itself is whole and stays at {left}")
