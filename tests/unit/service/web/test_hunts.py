"""The hunts that the page shows are those that `pamrig gap hunt` keeps."""

import json
from pathlib import Path

from rig.app.gap.campaign import FILE, Campaign, Step
from rig.service.web.files.hunts import hunts


def test_a_hunt_is_told_step_by_step(tmp_path: Path) -> None:
    done = Step("step_1.yaml", "parts delay from friction", 2.5, "step_1", (("delay", 0.7), ("friction", 0.2)))
    Campaign(tmp_path / "hunt_a", {}, (done, Step("step_2.yaml", "slower", 4.0)), "").save()
    (told,) = hunts(tmp_path)
    assert (told["name"], told["ended"]) == ("hunt_a", "")
    assert told["steps"][0]["possible"][0] == {"name": "delay", "probability": 0.7}
    assert [step["done"] for step in told["steps"]] == [True, False]


def test_what_is_no_hunt_is_left_out(tmp_path: Path) -> None:
    for name, text in {"a": "", "b": "[1]", "c": json.dumps({"ended": "", "steps": [{}]}), "d": "{"}.items():
        (tmp_path / name).mkdir()
        (tmp_path / name / FILE).write_text(text)
    (tmp_path / "e").mkdir()
    assert hunts(tmp_path) == []
    assert hunts(tmp_path / "nowhere") == []
