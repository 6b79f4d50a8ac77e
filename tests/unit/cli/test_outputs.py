"""One rule for every output of every command: what somebody may still need is never lost by it."""

import contextlib
import json
import os
import stat
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner
from support.click_tree import commands
from support.records.made_logs import made_content, made_log
from support.run_command import PAMRIG

from rig.app import shipped
from rig.cli.commands import cli
from rig.cli.outputs import Command, Output
from rig.errors import RigError
from rig.log.convert import write_content
from rig.log.reader import read
from rig.outputs import OutputKind, check_apart, check_place, file_name, targets_in, write_text, writing

WRITES = {
    "json",
    "html",
    "figures",
    "figure",
    "output",
    "out",
    "augmented-model",
    "next-experiment",
    "retuned",
}
MODEL = "configs/models/simulated.yaml"


def test_every_command_and_every_option_that_writes_keeps_the_rule() -> None:
    for name, command in commands(cli, "pamrig"):
        assert name == "pamrig" or isinstance(command, Command), name
        for option in command.params:
            names = {opt.lstrip("-") for opt in option.opts}
            assert not names & WRITES or isinstance(option.type, Output), (name, option.opts)
            assert not names & {"o", "output", "out"} or names == {"o", "output", "out"}, (name, option.opts)


def run(*words: str | Path) -> tuple[str, int]:
    """The one line of an error, and the exit status."""
    result = CliRunner().invoke(cli, [str(word) for word in words])
    return (str(result.exception), 2) if isinstance(result.exception, RigError) else (result.output, result.exit_code)


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """A recording."""
    made_log(tmp_path / "rec.mcap")
    return tmp_path / "rec.mcap"


def onto_the_recording(log: Path) -> dict[str, list[str]]:
    """Calls of every command that takes a log, with an output on the recording itself."""
    it, model = str(log), MODEL
    return {
        "identify -o": ["identify", it, "-o", it],
        "identify --json": ["identify", it, "-o", f"{log.parent}/m.yaml", "--json", it],
        "identify --figures": ["identify", it, "-o", f"{log.parent}/m.yaml", "--figures", it],
        "validate --json": ["validate", model, it, "--json", it],
        "simulate -o": ["simulate", it, "--model", model, "-o", it],
        "simulate --figure": ["simulate", it, "--model", model, "-o", f"{log.parent}/o.mcap", "--figure", it],
        "replay -o": ["replay", it, "-o", it],
        "replay --figure": ["replay", it, "-o", f"{log.parent}/o.mcap", "--figure", it],
        "gap --html": ["gap", "diagnose", "--model", model, "--log", it, "--html", it],
        "gap --augmented-model": ["gap", "diagnose", "--model", model, "--log", it, "--augmented-model", it],
        "gap --next-experiment": ["gap", "diagnose", "--model", model, "--log", it, "--next-experiment", it],
        "gap --json": ["gap", "diagnose", "--model", model, "--log", it, "--json", it],
        "info --json": ["log", "info", it, "--json", it],
        "check --json": ["log", "check", it, "--json", it],
        "recover -o": ["log", "recover", it, "-o", it],
        "import -o": ["log", "import", it, "-o", it],
        "export -o": ["log", "export", it, "-o", it],
        "plot -o": ["log", "plot", it, "-o", it],
        "run --out": ["run", "quick", "--clock", "virtual", "--out", it],
        "calibrate -o": ["devices", "calibrate", "angle", "-o", it],
        "list --json": ["devices", "list", "--json", it],
        "bench --json": ["bench", "--json", it],
        "check --html": ["gap", "check", "--html", it],
    }


@pytest.mark.parametrize("call", list(onto_the_recording(Path("x"))))
def test_a_recording_stays_whatever_is_written_onto_it(log: Path, call: str) -> None:
    before = log.read_bytes()
    said, status = run(*onto_the_recording(log)[call])
    assert (status, "\n" in said.strip()) == (2, False), said
    assert str(log) in said
    assert log.read_bytes() == before
    assert [path.name for path in log.parent.iterdir()] == ["rec.mcap"]


def test_a_model_that_is_read_is_not_written(log: Path, tmp_path: Path) -> None:
    model = tmp_path / "model.yaml"
    model.write_text(Path(MODEL).read_text())
    said, status = run("gap", "diagnose", "--model", model, "--log", log, "--augmented-model", model)
    assert status == 2
    assert "--model reads" in said
    link = tmp_path / "link.yaml"
    link.symlink_to(model)
    assert run("identify", log, "--start", model, "-o", link)[1] == 2


@pytest.mark.parametrize("named", ["simulated", "simulated.yaml", MODEL])
def test_nor_is_one_that_comes_with_us_and_is_read_by_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, named: str
) -> None:
    monkeypatch.chdir(tmp_path)  # an empty folder: there is no log to go on with
    model = shipped.configs() / "models" / "simulated.yaml"
    said, status = run("gap", "diagnose", "--model", named, "--log", ".", "--augmented-model", model)
    assert status == 2
    assert f"{model}: that is the file which --model reads" in said


def test_a_folder_may_be_called_as_the_sweep_that_comes_with_us(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`-o quick` was refused as the file which SWEEP reads, though no file of that name is there."""
    monkeypatch.chdir(tmp_path)
    said, status = run("simulate", "quick", "--model", "simulated", "-o", "quick")
    assert status == 0, said
    assert (tmp_path / "quick" / "sine_0.5hz_0.20mpa.mcap").exists()


def test_two_outputs_are_two_files(log: Path, tmp_path: Path) -> None:
    one = tmp_path / "one.json"
    said, status = run(
        "gap", "diagnose", "--model", MODEL, "--log", log, "--html", one, "--json", f"{tmp_path}/./one.json"
    )
    assert status == 2
    assert "--html writes" in said
    assert not one.exists()


@pytest.mark.parametrize(
    ("kind", "name", "own"),
    [
        (OutputKind.JSON, "x.json", b'{"a": 1}'),
        (OutputKind.PAGE, "x.html", b"<!doctype html>"),
        (OutputKind.FIGURE, "x.png", b"\x89PNG\r\n"),
        (OutputKind.FIGURE, "x.svg", b"<?xml?><svg>"),
        (OutputKind.FIGURE, "x.pdf", b"%PDF-1.4"),
        (OutputKind.MODEL, "x.yaml", b"# mine\nmuscle:\n  kind: bw\n"),
        (OutputKind.SWEEP, "x.yaml", b"name: x\nrecords: []\n"),
        (OutputKind.CALIBRATION, "x.yaml", b"# By\nangle: {}\n"),
        (OutputKind.TABLE, "x.csv", b"record,rmse_deg\n"),
        (OutputKind.TABLE, "x.md", b"| record | rmse_deg |\n"),
    ],
)
def test_a_file_is_replaced_by_its_own_kind_only(tmp_path: Path, kind: OutputKind, name: str, own: bytes) -> None:
    place = tmp_path / name
    for there, allowed in ((own, True), (b"", True), (b"t_s,dp_cmd_mpa\n0,0\n", False), (b"\x89MCAP0\r\n", False)):
        place.write_bytes(there)
        if allowed:
            with writing(place, kind) as part:
                part.write_bytes(b"new")
            assert place.read_bytes() == b"new"
            continue
        with pytest.raises(RigError, match="is not overwritten"), writing(place, kind):
            pass
        assert place.read_bytes() == there


OWN_KIND = {
    "models": {OutputKind.MODEL},
    "rigs": {OutputKind.RIG},
    "sweeps": {OutputKind.SWEEP},
    "references": {OutputKind.SWEEP},
    "imports": {OutputKind.MAPPING},
    "modbus": set(),
}


def replaceable_by(path: Path) -> set[OutputKind]:
    """The kinds that may take the place of this file."""
    found = set()
    for kind in set(OutputKind) - {OutputKind.FOLDER, OutputKind.FIGURE}:
        with contextlib.suppress(RigError):
            check_place(path, kind)
            found.add(kind)
    return found


@pytest.mark.parametrize("folder", list(OWN_KIND))
def test_each_file_of_our_own_has_one_kind(folder: str) -> None:
    for path in (shipped.configs() / folder).glob("*.yaml"):
        assert replaceable_by(path) == OWN_KIND[folder], path


@pytest.mark.parametrize(
    ("name", "text", "kinds"),
    [
        ("hunt.json", '{\n "version": 1,\n "asked": {},\n "steps": []\n}\n', {OutputKind.HUNT}),
        ("sealed.json", '{\n "cases": 3,\n "format": "pamrig blind check 2"\n}\n', set()),
        ("thesis.ipynb", '{"cells": [], "nbformat": 4}', set()),
        ("records.jsonl", '{"path": "x"}\n', set()),
        ("notes.md", "# Monday\n\nThe left muscle leaks.\n", set()),
        ("results.md", "# Results\n\n| a | b |\n|---|---|\n| 1 | 2 |\n", {OutputKind.PAGE}),
        ("scores.md", "| record | rmse_deg |\n| --- | --- |\n", {OutputKind.PAGE, OutputKind.TABLE}),
        ("pamrig.prom", "# HELP pamrig_state x\n", {OutputKind.METRICS}),
        ("other.prom", "# HELP node_load1 x\n", set()),
    ],
)
def test_what_is_kept_for_later_is_no_result(tmp_path: Path, name: str, text: str, kinds: set[OutputKind]) -> None:
    (tmp_path / name).write_text(text)
    assert replaceable_by(tmp_path / name) == kinds


@pytest.mark.parametrize("suffix", [".mcap", ".yaml", ".json", ".html", ".svg", ".md", ".csv"])
def test_a_recording_is_not_taken_for_what_it_keeps_of_rig_sweep_and_model(tmp_path: Path, suffix: str) -> None:
    kept = {path.name: path.read_bytes() for path in shipped.configs().glob("[mrs]*/*.yaml")}
    kept |= {"page.html": b"<!doctype html><svg>", "scores.csv": b"record,rmse_deg\n", "hunt.json": b"{}"}
    for name, content in kept.items():
        place = tmp_path / f"{Path(name).stem}{suffix}"
        write_content(replace(made_content(20), attachments={name: content}), place.with_suffix(".mcap")).rename(place)
        assert content in place.read_bytes()
        assert replaceable_by(place) == set()
        if suffix == ".svg":
            with pytest.raises(RigError, match="is not a figure"):
                check_place(place, OutputKind.FIGURE)


@pytest.mark.parametrize(
    "said", ["Dear diary\n\nrecords:\nmuscle:\n", "```yaml\ndevices:\n```\n", "# x\n\n- a\nangle:\n"]
)
def test_notes_with_a_piece_of_yaml_are_notes(tmp_path: Path, said: str) -> None:
    (tmp_path / "notes.txt").write_text(said)
    assert replaceable_by(tmp_path / "notes.txt") == set()


def test_facts_beside_an_exported_table_are_part_of_the_recording(tmp_path: Path) -> None:
    aside = tmp_path / "x.csv-metadata.json"
    aside.write_text("{}")
    with pytest.raises(RigError, match="is not overwritten"):
        write_text(aside, "[]", OutputKind.JSON)


def interrupted(place: Path) -> None:
    """Ctrl-C in the middle of writing."""
    with writing(place, OutputKind.JSON) as part:
        part.write_text("[1,")
        raise KeyboardInterrupt


def test_a_file_is_there_whole_or_as_it_was(tmp_path: Path) -> None:
    place = tmp_path / "x.json"
    place.write_text("{}")
    place.chmod(0o640)
    with pytest.raises(KeyboardInterrupt):
        interrupted(place)
    assert place.read_text() == "{}"
    write_text(place, "[1]", OutputKind.JSON)
    assert (place.read_text(), stat.S_IMODE(place.stat().st_mode)) == ("[1]", 0o640)
    assert [path.name for path in tmp_path.iterdir()] == ["x.json"]


def test_identify_says_that_its_model_takes_the_place_of_another(log: Path, tmp_path: Path) -> None:
    quick = ("--seeds", "1", "--particles", "4", "--iterations", "3", "--no-polish", "--unbounded")
    said = [run("identify", log, "-o", tmp_path / "m.yaml", *quick) for _ in range(2)]
    assert [status for _, status in said] == [0, 0], said
    first, second = (text.strip().splitlines()[-2:] for text, _ in said)
    replaced = f"model: {tmp_path / 'm.yaml'}, in place of the one that was there"
    assert (replaced in first, replaced in second) == (False, True)


def test_a_link_stays_a_link_and_a_device_a_device(tmp_path: Path) -> None:
    (tmp_path / "real.json").write_text("{}")
    (tmp_path / "link.json").symlink_to("real.json")
    write_text(tmp_path / "link.json", "[2]", OutputKind.JSON)
    assert (tmp_path / "link.json").is_symlink()
    assert (tmp_path / "real.json").read_text() == "[2]"
    write_text(Path("/dev/null"), "[3]", OutputKind.JSON)
    assert stat.S_ISCHR(os.stat("/dev/null").st_mode)
    check_apart([("--json", Path("/dev/null")), ("--html", Path("/dev/null"))], [])


@pytest.mark.parametrize(
    "name",
    ["../../x", "/abs/x", "..", ".", "", "a/b", "a\0b", "\x1b[2J", "ä" * 200, "x" * 4000, ".hidden", "\ud800", "con\n"],
)
def test_a_name_becomes_a_file_in_its_folder(tmp_path: Path, name: str) -> None:
    (target,) = targets_in(tmp_path, [name], ".svg")
    target.write_text("")
    assert target.resolve().parent == tmp_path.resolve()
    assert not target.name.startswith(".")
    assert len(target.name.encode()) < 120


def test_usual_names_stay_and_equal_ones_are_numbered(tmp_path: Path) -> None:
    assert file_name("sine_0.5hz_0.20mpa") == "sine_0.5hz_0.20mpa"
    names = [path.name for path in targets_in(tmp_path, ["a", "A", "a/", "a_2", "b"], ".png")]
    assert names == ["a.png", "A_2.png", "a_3.png", "a_2_2.png", "b.png"]


@pytest.mark.parametrize("name", ["../../escaped", "/tmp/escaped_absolutely"])
def test_a_record_named_like_a_path_is_written_into_the_folder(tmp_path: Path, name: str) -> None:
    from dataclasses import replace

    deep, out = tmp_path / "a" / "b", tmp_path / "a" / "b" / "out"
    out.mkdir(parents=True)
    content = made_content()
    write_content(replace(content, run_facts={**content.run_facts, "name": name}), deep / "in.mcap")
    (deep / "logs").mkdir()
    (deep / "in.mcap").rename(deep / "logs" / "in.mcap")
    before = {path for path in tmp_path.rglob("*") if out not in path.parents}
    assert run("log", "plot", deep / "logs", "-o", out)[1] == 0
    assert run("simulate", deep / "logs", "--model", MODEL, "-o", out)[1] == 0
    assert len(list(out.iterdir())) == 2
    assert {path for path in tmp_path.rglob("*") if out not in path.parents} == before
    assert not Path("/tmp/escaped_absolutely.svg").exists()
    assert len(read(next(out.glob("*.mcap")))) == 1


def test_json_of_a_result_replaces_json(log: Path, tmp_path: Path) -> None:
    out = tmp_path / "x.json"
    for _ in range(2):
        assert run("log", "info", log, "--json", out)[1] == 0
        assert json.loads(out.read_text())["files"]


def test_what_comes_into_a_file_by_a_descriptor_is_added_to_it(log: Path, tmp_path: Path) -> None:
    """`--json /dev/stdout >> results.json` put a new file in the place of the old one: what stood there was gone."""
    results = tmp_path / "results.json"
    results.write_text('{"of": "yesterday"}\n')
    with results.open("a") as kept:
        subprocess.run([PAMRIG, "log", "info", log, "--json", "/dev/stdout"], stdout=kept, check=True)
    before, _, added = results.read_text().partition("\n")
    assert before == '{"of": "yesterday"}'
    assert json.loads(added)["files"][0]["samples"]


def test_a_descriptor_that_leads_into_a_file_is_no_place_for_another(tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    page.write_text("<!doctype html>\n")
    with page.open("a") as kept:
        link = tmp_path / "link.html"
        link.symlink_to(f"/dev/fd/{kept.fileno()}")
        for place in (link, Path(f"/proc/self/fd/{kept.fileno()}")):
            with pytest.raises(RigError, match=r"it leads into a file, where more may stand; name a file of its own$"):
                write_text(place, "<!doctype html>", OutputKind.PAGE)
    read_end, write_end = os.pipe()
    with open(read_end) as reader, open(write_end, "w"):
        write_text(Path(f"/dev/fd/{write_end}"), "a line\n", OutputKind.PAGE)
        assert reader.readline() == "a line\n"


@pytest.mark.parametrize("name", ["x" * 5000, "a\0b", "\ud800"])
def test_a_name_that_no_file_can_have_is_one_line(log: Path, name: str) -> None:
    said, status = run("log", "info", log, "--json", name)
    assert (status, "\n" in said.strip()) == (2, False)


def test_a_folder_named_in_another_encoding_is_read_and_told(log: Path, tmp_path: Path) -> None:
    """As an old disk has them: bytes that are no UTF-8."""
    day = Path(os.fsdecode(os.fsencode(tmp_path) + b"/Messung_\xfc"))
    day.mkdir()
    log.rename(named := day / os.fsdecode(b"gr\xf6sse.mcap"))
    figures, page = tmp_path / "figures", tmp_path / "page.html"
    said, status = run("validate", MODEL, named, "--figures", figures)
    assert status == 0, said
    assert r"gr\udcf6sse.mcap" in (figures / "scores.csv").read_text()
    write_text(page, f"<!doctype html>{day}", OutputKind.PAGE)
    assert r"Messung_\udcfc" in page.read_text()


def test_several_values_behind_one_option_are_told_to_repeat_it() -> None:
    call = ["gap", "diagnose", "--model", "m.yaml", "--log", "a.csv", "b.csv"]
    done = CliRunner().invoke(cli, call)
    assert "extra argument (b.csv); an option takes one value; repeat it for several: --log A --log B" in str(
        done.output
    )
    assert "repeat it" not in CliRunner().invoke(cli, ["status", "b.csv"]).output
