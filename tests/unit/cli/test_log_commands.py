"""`pamrig log` and its exit statuses: 0 done, 1 not so, 2 the call or a file is wrong, never a traceback."""

import json
import os
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from support.records.made_logs import assert_same_content, made_content, made_log

from rig.cli.main import main
from rig.errors import RecordError
from rig.log import convert
from rig.log.convert import LogContent, read_content, write_content
from rig.log.reader import read
from rig.outputs import FIGURE_SUFFIXES


@pytest.fixture
def call(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> object:
    def run(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["pamrig", *(str(argument) for argument in arguments)])
        with pytest.raises(SystemExit) as caught:
            main()
        out, err = capsys.readouterr()
        return int(caught.value.code or 0), out, err

    return run


def test_info(call, tmp_path: Path) -> None:
    made_log(tmp_path / "run.mcap", 300)
    status, out, _ = call("log", "info", tmp_path / "run.mcap", "--json", "-")
    (item,) = json.loads(out)["files"]
    assert status == 0
    assert (item["samples"], item["facts"]["session"], item["attachments"]["photo.bin"]) == (300, "12e4", 256)
    assert item["log"][0] == [0.0, "info", "begun"]


def test_info_of_a_table_is_told_in_lines(call, tmp_path: Path) -> None:
    (tmp_path / "sine.csv").write_text("t_s,dp_cmd_mpa,angle_deg\n0,0,0\n0.01,0.1,1\n0.02,0.2,3\n")
    status, out, _ = call("log", "info", tmp_path / "sine.csv")
    assert status == 0
    assert out.splitlines()[1:7] == [
        *("  records:", "    name: sine", "    rows: 3", "    seconds: 0.02"),
        *("    period_s: 0.01", "    columns: t_s, dp_cmd_mpa, angle_deg"),
    ], "a person read Python's own words for a list"


def test_info_of_several_is_a_line_each(call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder of seven records was three hundred lines."""
    monkeypatch.setenv("COLUMNS", "400")
    made_log(tmp_path / "a.mcap", 300)
    content = made_content(400)
    facts = {**content.result_facts, "fault": "DEVICE_LOST", "ended": "fault", "missed": 3}
    write_content(replace(content, result_facts=facts), tmp_path / "b.mcap")
    (tmp_path / "sine.csv").write_text("t_s,dp_cmd_mpa,angle_deg\n0,0,0\n0.01,0.1,1\n0.02,0.2,3\n")
    status, out, _ = call("log", "info", tmp_path)
    assert status == 0
    titles, *lines = [line.split() for line in out.splitlines()]
    assert titles == ["log", "session", "began", "(UTC)", "seconds", "samples", "missed", "ended"]
    assert [line[0] for line in lines] == [f"{tmp_path}/{name}" for name in ("a.mcap", "b.mcap", "sine.csv")]
    assert lines[1][-4:] == ["400", "3", "fault:", "DEVICE_LOST"]
    assert lines[2][1:] == [tmp_path.name, "0.02", "3"]


def test_check_says_all_findings_and_ends_with_one(call, tmp_path: Path) -> None:
    made_log(tmp_path / "a.mcap", 300)
    content = made_content(300)
    content.samples["p1_mpa"][7] = 0.9
    write_content(content, tmp_path / "b.mcap")
    status, out, err = call("log", "check", tmp_path, "--json", tmp_path / "result.json")
    files = json.loads((tmp_path / "result.json").read_text())["files"]
    assert status == 1
    assert [item["ok"] for item in files] == [True, False]
    assert out.splitlines() == [f"{tmp_path}/a.mcap: ok", f"{tmp_path}/b.mcap: {files[1]['findings'][0]}"]
    assert err == "pamrig: 1 of 2 logs not in order\n"
    assert call("log", "check", tmp_path / "a.mcap")[0] == 0


def test_check_names_what_is_not_finished(call, tmp_path: Path) -> None:
    (tmp_path / "cut.mcap.partial").write_bytes(b"")
    status, out, _ = call("log", "check", tmp_path)
    assert (status, out.splitlines()[0].split(": ")[:2]) == (1, [f"{tmp_path}/cut.mcap.partial", "not finished"])
    made_log(tmp_path / "a.mcap", 300)
    status, out, err = call("log", "check", tmp_path)
    assert out.startswith(f"{tmp_path}/a.mcap: ok\n")
    assert (status, err) == (1, "pamrig: 1 of 2 logs not in order\n")


def test_check_goes_on_beyond_a_file_that_cannot_be_read(call, tmp_path: Path) -> None:
    """It ended with the first such file of a folder, and said nothing of the others."""
    os.symlink("/proc/1/mem", tmp_path / "a.csv")  # nobody reads its first page
    made_log(tmp_path / "b.mcap", 300)
    status, out, err = call("log", "check", tmp_path)
    assert (status, err) == (1, "pamrig: 1 of 2 logs not in order\n")
    first, second = out.splitlines()
    assert first.startswith(f"{tmp_path}/a.csv: cannot be read: ")
    assert second == f"{tmp_path}/b.mcap: ok"
    assert call("log", "check", tmp_path / "a.csv")[0] == 2, "of a file that is named it is the call that is wrong"


def test_the_name_of_a_file_says_nothing_of_another(call, tmp_path: Path) -> None:
    """A line break in it made a line of ours: `a.mcap: ok`, of a file that was cut."""
    (tmp_path / "a.mcap").write_bytes(b"")
    made_log(tmp_path / "a.mcap: ok\nb.mcap", 300)
    _, out, _ = call("log", "check", tmp_path)
    assert sorted(line.removeprefix(f"{tmp_path}/") for line in out.splitlines()) == [
        "a.mcap: ok\\nb.mcap: ok",
        "a.mcap: the file is empty",
    ]


def test_recover(call, tmp_path: Path) -> None:
    made_log(tmp_path / "run.mcap", 500)
    data = (tmp_path / "run.mcap").read_bytes()
    (tmp_path / "cut.mcap.partial").write_bytes(data[: len(data) * 2 // 3])
    status, out, err = call("log", "recover", tmp_path / "cut.mcap.partial", "-o", tmp_path / "cut.mcap", "--json", "-")
    result = json.loads(out)
    assert status == 0
    assert (result["file"], result["verified"]) == (str(tmp_path / "cut.mcap"), True)
    assert result["records"] % 100 == 0
    assert "every one verified by its CRC" in err
    assert len(read_content(tmp_path / "cut.mcap").samples) == result["records"]
    status, out, _ = call("log", "recover", tmp_path / "run.mcap")
    assert (status, out) == (0, f"{tmp_path}/run.mcap: whole, with 500 samples; nothing was written\n")
    (tmp_path / "bad.mcap").write_bytes(data[:100])
    status, _, err = call("log", "recover", tmp_path / "bad.mcap")
    assert status == 2
    assert "nothing to save" in err


@pytest.mark.parametrize("kind", ["csv", "csv.gz", "mat"])
def test_there_and_back(call, tmp_path: Path, kind: str) -> None:
    content = made_log(tmp_path / "run.mcap", 300)
    assert call("log", "export", tmp_path / "run.mcap", "--to", kind, "-o", tmp_path / "out")[0] == 0
    assert call("log", "import", tmp_path / "out" / f"run.{kind}", "-o", tmp_path / "new" / "back.mcap")[0] == 0
    assert_same_content(read_content(tmp_path / "new" / "back.mcap"), content)


def test_resampling_only_on_request_and_said(call, tmp_path: Path) -> None:
    made_log(tmp_path / "run.mcap", 1000, missed_at=500)
    status, out, _ = call("log", "export", tmp_path / "run.mcap", "--period", "0.01", "-o", tmp_path / "r.csv")
    assert (status, out.endswith("rows, resampled to 0.01 s\n")) == (0, True)
    (record,) = read(tmp_path / "r.csv")
    assert record.facts["resampled_to_s"] == 0.01
    assert record.period_s == pytest.approx(0.01)
    assert call("log", "export", tmp_path / "run.mcap", "--period", "-1", "-o", tmp_path / "s.csv")[0] == 2


def test_import_says_what_it_leaves_out_and_what_it_cannot_take(call, tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t_s,dp_cmd_mpa,load_n\n0,0,1\n1,1,2\n")
    status, out, _ = call("log", "import", tmp_path / "a.csv", "-o", tmp_path / "a.mcap")
    assert status == 0
    assert "not kept, by the mapping or for want of a field: load_n" in out
    made_log(tmp_path / "run.mcap", 100)
    status, _, err = call("log", "import", tmp_path / "run.mcap", "-o", tmp_path / "b.mcap")
    assert status == 2
    assert "importing MCAP needs a --mapping; it has /rig/sample (protobuf, pamrig.Sample)" in err


def test_a_folder_of_files_is_imported_by_one_call_or_not_at_all(call, tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / f"{name}.csv").write_text("t_s,dp_cmd_mpa,load_n\n0,0,1\n1,1,2\n")
    files, out = sorted(tmp_path.glob("*.csv")), tmp_path / "day"
    status, said, _ = call("log", "import", *files, "-o", out)
    assert (status, said.count("not kept"), sorted(file.name for file in out.iterdir())) == (
        0, 1, ["a.mcap", "b.mcap"]
    )  # fmt: skip
    assert "day/a.mcap: exists already" in call("log", "import", *files, "-o", out)[2]
    (tmp_path / "c.csv").write_text("t_s,load_n\n0,0\n")
    status, _, err = call("log", "import", *files, tmp_path / "c.csv", "-o", tmp_path / "next")
    assert (status, "c.csv: no column dp_cmd_mpa" in err, (tmp_path / "next").exists()) == (2, True, False)


def test_a_folder_is_refused_with_the_call_that_takes_its_files(call, tmp_path: Path) -> None:
    raw = tmp_path / "raw"
    raw.mkdir()
    for guessing in ((), ("--guess",)):
        assert f"{raw}: a folder; name its files, as in {raw}/*.csv" in call("log", "import", raw, *guessing)[2]
    for name in ("a.lvm", "b.lvm", "notes.txt"):
        (raw / name).write_text("x\n")
    assert f"name its files, as in {raw}/*.lvm" in call("log", "import", raw)[2]


def test_names_that_are_not_ours_are_refused_with_what_proposes_a_mapping(call, tmp_path: Path) -> None:
    table = tmp_path / "own.csv"
    for head in ("Time [ms];Set (bar)\n0;1\n", "t_s,Set\n0,1\n"):
        table.write_text(head)
        status, _, err = call("log", "import", table)
        assert status == 2
        assert "--guess proposes a mapping" in err


def test_a_disk_that_fills_midway_leaves_no_half_of_a_day(
    call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("a", "b"):
        (tmp_path / f"{name}.csv").write_text("t_s,dp_cmd_mpa\n0,0\n1,1\n")

    def until_full(content: LogContent, path: Path) -> Path:
        if path.name == "b.mcap":
            raise RecordError(f"{path}: cannot be written: No space left on device")
        return write_content(content, path)

    with monkeypatch.context() as full:
        full.setattr(convert, "write_content", until_full)
        status, _, err = call("log", "import", *sorted(tmp_path.glob("*.csv")), "-o", tmp_path / "day")
    assert (status, "b.mcap: cannot be written" in err, [*(tmp_path / "day").iterdir()]) == (2, True, [])
    assert call("log", "import", *sorted(tmp_path.glob("*.csv")), "-o", tmp_path / "day")[0] == 0


def test_several_imports_say_as_json_what_one_says(call, tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / f"{name}.csv").write_text("t_s,dp_cmd_mpa\n0,0\n1,1\n")
    one = {"file": str(tmp_path / "one.mcap"), "records": 2, "not_kept": []}
    call("log", "import", tmp_path / "a.csv", "-o", tmp_path / "one.mcap", "--json", tmp_path / "one.json")
    assert json.loads((tmp_path / "one.json").read_text()) == one | {"files": [one]}
    call("log", "import", tmp_path / "a.csv", tmp_path / "b.csv", "-o", tmp_path, "--json", tmp_path / "two.json")
    assert [each["file"] for each in json.loads((tmp_path / "two.json").read_text())["files"]] == [
        str(tmp_path / "a.mcap"), str(tmp_path / "b.mcap")
    ]  # fmt: skip


@pytest.mark.parametrize("suffix", FIGURE_SUFFIXES)
def test_plots(call, tmp_path: Path, suffix: str) -> None:
    made_log(tmp_path / "run.mcap", 600, missed_at=300)
    target = tmp_path / f"figure{suffix}"
    assert call("log", "plot", tmp_path / "run.mcap", "-o", target)[0] == 0
    assert target.stat().st_size > 10_000
    if suffix == ".svg":
        text = target.read_text()
        assert all(label in text for label in ("missed ticks", "over the measured pressures", "p1 set-point"))


def test_a_picture_in_the_terminal(call, tmp_path: Path) -> None:
    made_log(tmp_path / "run.mcap", 600)
    status, out, _ = call("log", "plot", tmp_path / "run.mcap", "--from", "0.5", "--until", "1.5")
    assert status == 0
    assert "sine_0.5hz_0.20mpa: angle [deg]" in out
    assert "\x1b" not in out
    assert max(len(line) for line in out.splitlines()) <= 120


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("info", "nowhere.csv"), "nowhere.csv: cannot be read: No such file or directory"),
        (("plot", "RUN", "-o", "x.gif"), "x.gif: a figure is written as .png, .svg, .pdf"),
        (("plot", "RUN", "--from", "99"), "has 0 rows from 99 s on; it lasts"),
        (("export", "RUN", "--to", "xlsx"), "Invalid value for '--to'"),
        (("check",), "Missing argument 'LOG...'"),
        (("import", "RUN", "--mapping", "no.yaml"), "no.yaml: no such file"),
        (("import", "RUN", "RUN", "--guess"), "--guess looks at one FILE; 2 are given"),
    ],
)
def test_wrong_calls(
    call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: tuple[str, ...], message: str
) -> None:
    monkeypatch.chdir(tmp_path)
    made_log(tmp_path / "run.mcap", 100)
    status, _, err = call("log", *(argument.replace("RUN", "run.mcap") for argument in arguments))
    assert status == 2
    assert message in err
    assert "Traceback" not in err


def test_an_import_does_not_say_valid_for_nobody_saw_its_run(call, tmp_path: Path) -> None:
    table, log = tmp_path / "sine.csv", tmp_path / "sine.mcap"
    table.write_text("t_s,dp_cmd_mpa,angle_deg\n0,0,0\n0.005,0.1,1\n0.010,0.2,3\n")
    assert call("log", "import", table, "-o", log)[0] == 0
    assert "valid" not in read_content(log).result_facts
    assert "ended: not known: imported from sine.csv" in call("log", "info", log)[1]
    assert call("log", "check", log)[:2] == (0, f"{log}: ok\n")
    assert [record.name for record in read(tmp_path)] == ["sine"]
    (tmp_path / "seen.yaml").write_text(
        "columns: {t_s: {source: t_s}, dp_cmd_mpa: {source: dp_cmd_mpa}, angle_deg: {source: angle_deg}}\n"
        "facts: {valid: true}\n"
    )
    call("log", "import", table, "--mapping", tmp_path / "seen.yaml", "-o", tmp_path / "seen.mcap")
    assert read_content(tmp_path / "seen.mcap").result_facts["valid"] is True


def test_figures_go_into_a_folder_that_is_not_there_yet(call, tmp_path: Path) -> None:
    made_log(tmp_path / "logs" / "run.mcap", 300)
    assert call("log", "plot", tmp_path / "logs", "-o", tmp_path / "new" / "figures")[0] == 0
    assert [file.name for file in (tmp_path / "new" / "figures").iterdir()] == ["sine_0.5hz_0.20mpa.svg"]
    status, _, err = call("log", "plot", tmp_path / "logs", "-o", tmp_path / "one.svg")
    assert status == 2
    assert "may hold many records; give a folder, each gets a figure of its name" in err


@pytest.mark.parametrize("suffix", [".CSV", ".Parquet", ".MAT"])
def test_a_suffix_in_capitals_is_the_same_suffix(call, tmp_path: Path, suffix: str) -> None:
    made_log(tmp_path / "run.mcap", 300)
    kept, kind = tmp_path / f"run{suffix}", suffix[1:].lower()
    assert call("log", "export", tmp_path / "run.mcap", "--to", kind, "-o", kept)[0] == 0
    assert call("log", "import", kept, "-o", tmp_path / "again.MCAP")[0] == 0
    assert_same_content(read_content(tmp_path / "again.MCAP"), read_content(tmp_path / "run.mcap"))


def test_one_simulated_record_goes_into_the_file_that_was_named(call, tmp_path: Path) -> None:
    made_log(tmp_path / "run.mcap", 300)
    said = tmp_path / "said.MCAP"
    assert call("simulate", tmp_path / "run.mcap", "--model", "simulated", "-o", said)[0] == 0
    assert said.is_file()
