"""The hunts that the page shows are those that `pamrig gap hunt` keeps."""

import json
import os
from pathlib import Path

import pytest

from rig.app.gap.hunt.folder import FILE, Hunt, HuntStep, open_hunt
from rig.errors import ConfigError
from rig.service.web.files.hunts import hunts


def test_a_hunt_is_told_step_by_step(tmp_path: Path) -> None:
    done = HuntStep("step_1.yaml", "parts delay from friction", 2.5, "step_1", (("delay", 0.7), ("friction", 0.2)))
    Hunt(tmp_path / "hunt_a", {}, (done, HuntStep("step_2.yaml", "slower", 4.0)), "").save()
    (told,) = hunts(tmp_path)
    assert (told["name"], told["ended"]) == ("hunt_a", "")
    assert told["steps"][0]["possible"][0] == {"name": "delay", "probability": 0.7}
    assert [step["done"] for step in told["steps"]] == [True, False]


def test_a_hunt_in_a_folder_whose_name_is_no_utf8_is_shown(tmp_path: Path) -> None:
    Hunt(tmp_path / "h\udcff", {}, (), "named").save()
    assert [told["name"] for told in hunts(tmp_path)] == [r"h\xff"]


def test_what_is_no_hunt_is_left_out(tmp_path: Path) -> None:
    for name, text in {"a": "", "b": "[1]", "c": json.dumps({"ended": "", "steps": [{}]}), "d": "{"}.items():
        (tmp_path / name).mkdir()
        (tmp_path / name / FILE).write_text(text)
    (tmp_path / "e").mkdir()
    assert hunts(tmp_path) == []
    assert hunts(tmp_path / "nowhere") == []


HOSTILE = [
    "[" * 100_000,
    '{"ended": "\\ud800", "steps": []}',
    '{"ended": "", "steps": [{"sweep": "x", "why": "", "minutes": 1e400, "records": "", "set": []}]}',
    '{"ended": "", "steps": [{"sweep": "x", "why": "", "minutes": NaN, "records": "", "set": []}]}',
    '{"ended": "", "steps": [{"sweep": "x", "why": "", "minutes": 1' + "0" * 400 + ', "records": "", "set": []}]}',
    '{"ended": "", "steps": [{"sweep": "x", "why": "", "minutes": 1, "records": "", "set": [["a"]]}]}',
    '{"ended": "", "steps": {"a": 1}}',
]


@pytest.mark.parametrize("text", HOSTILE)
def test_one_that_was_made_to_break_the_page_is_left_out_of_it(tmp_path: Path, text: str) -> None:
    (tmp_path / "bad").mkdir()
    (tmp_path / "bad" / FILE).write_text(text)
    Hunt(tmp_path / "good", {}, (), "time").save()
    assert [hunt["name"] for hunt in hunts(tmp_path)] == ["good"]


@pytest.mark.parametrize(
    "text",
    [
        "[" * 100_000,
        "[]",
        '{"version": 1, "asked": [1], "steps": []}',
        *HOSTILE[2:],
        '{"version": 1, "asked": {}, "steps": [{"sweep": "../x", "why": "", "minutes": 1, "records": "", "set": []}]}',
        '{"version": 1, "asked": {}, "steps": [{"sweep": "x", "why": "", "minutes": 1, "records": "/abs", "set": []}]}',
    ],
)
def test_nor_is_it_gone_on_with(tmp_path: Path, text: str) -> None:
    (tmp_path / FILE).write_text(text)
    with pytest.raises(ConfigError, match=r"hunt\.json: not a hunt's file"):
        open_hunt(tmp_path, {})


def test_a_pipe_in_its_place_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / FILE)
    with pytest.raises(ConfigError, match="not a regular file"):
        open_hunt(tmp_path, {})
