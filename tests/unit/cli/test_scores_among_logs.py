"""A folder of logs in which an earlier command left its figures and its table of scores: they are passed over."""

from pathlib import Path

import pytest
from click.testing import CliRunner
from support.records.made_logs import made_log

from rig.app.gap.baselines import sessions_of
from rig.cli.commands import cli
from rig.errors import RecordError
from rig.log.log_files import logs_in
from rig.log.reader import read

MODEL = "configs/models/simulated.yaml"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A log, and beside it what `pamrig validate --figures` made of it."""
    logs = tmp_path / "logs"
    logs.mkdir()
    made_log(logs / "sine_0.5hz_0.20mpa.mcap", 1000)
    done = CliRunner().invoke(cli, ["validate", MODEL, str(logs), "--figures", str(logs / "figures")])
    assert done.exception is None or isinstance(done.exception, SystemExit) or "not bounded" in str(done.exception)
    assert (logs / "figures" / "scores.csv").exists()
    return logs


def test_they_are_passed_over_and_named(folder: Path, caplog: pytest.LogCaptureFixture) -> None:
    assert len(read(folder)) == 1
    assert caplog.messages == [f"{folder / 'figures' / 'scores.csv'}: passed over: a table of scores, no record"]


def test_the_same_command_again_and_a_diagnosis_are_not_stopped_by_them(folder: Path) -> None:
    again = CliRunner().invoke(cli, ["log", "info", str(folder)])
    assert (again.exit_code, again.exception) == (0, None)
    diagnosed = CliRunner().invoke(cli, ["gap", "diagnose", "--model", MODEL, "--log", str(folder)])
    assert "scores.csv" not in str(diagnosed.exception)


def test_figures_are_no_earlier_day(folder: Path) -> None:
    folder.rename(folder.with_name("day 1"))
    made_log(folder.with_name("day 2") / "sine_0.5hz_0.20mpa.mcap", 100)
    (folder.with_name("day 1") / "figures").rename(folder.with_name("figures"))
    assert sessions_of([folder.parent]) == [folder.with_name("day 1"), folder.with_name("day 2")]


def test_a_folder_of_scores_alone_holds_no_log(folder: Path) -> None:
    with pytest.raises(RecordError, match="no log in this folder"):
        logs_in(folder / "figures")


def test_a_record_whose_first_column_is_a_record_number_is_one(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("record,t_s,dp_cmd_mpa,angle_deg\n1,0,0,0\n1,0.005,0.01,1.5\n1,0.010,0.02,3\n")
    assert len(read(tmp_path)) == 1


def test_a_log_in_the_place_of_the_model_is_said_to_stand_there(folder: Path) -> None:
    """ "it is a folder, and a file is meant" did not say which of the two comes first."""
    turned = CliRunner().invoke(cli, ["validate", str(folder), MODEL])
    assert turned.exit_code == 2
    assert "MODEL.yaml comes first, the logs behind it" in turned.output
