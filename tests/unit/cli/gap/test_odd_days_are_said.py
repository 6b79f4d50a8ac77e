"""Every command that takes earlier days says which they are, and which of them disagrees with the others and is left
out. What the commands then do with the days is taken out: it takes seconds, and others test it."""

import csv
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from rig.app.gap import history as app_history
from rig.app.gap import planning
from rig.app.gap.hunt import report
from rig.channels import PNEUMATIC
from rig.cli.gap.group import gap
from rig.gap.history import sentences, trends

MODEL = "configs/models/simulated.yaml"
POWER = SimpleNamespace(seen=0.5, parted=0.5)
SESSION = SimpleNamespace(
    text=lambda _: "records: []\n",
    design=SimpleNamespace(power=POWER, seconds=60.0),
    default=POWER,
    default_s=60.0,
    rigs=1,
)
ABLE = SimpleNamespace(kind=SimpleNamespace(value="sessions"), sweeps={}, channels=PNEUMATIC, notes=())
HUNTED = SimpleNamespace(thought=None, hunt=SimpleNamespace(ended="named", minutes=1.0, folder=Path()))
PAST = SimpleNamespace(days=[], channels=PNEUMATIC)
Work = tuple[Any, str, Any]
COMMANDS: dict[str, tuple[list[str], list[Work]]] = {
    "capability": ([MODEL], [(planning, "capability_of", ABLE), (planning, "report_capability", {})]),
    "design": ([MODEL, "-o", "{}/new.yaml"], [(planning, "design_session", SESSION)]),
    "history": (
        ["{}/log", "--model", MODEL],
        [
            (app_history, "history_days", ([], SimpleNamespace(complain=lambda: None))),
            (app_history, "history_report", {}),
            (trends, "look_back", PAST),
            (sentences, "history_sentences", []),
        ],
    ),
    "hunt": (["--model", MODEL, "-o", "{}/hunt"], [(report, "hunt_and_tell", HUNTED)]),
}
"""Command -> its words, and what stands in for its work."""


@pytest.fixture
def days(tmp_path: Path) -> Path:
    """Three days of one record; on the last the angle is half of what it was. And the folder of a day to look at."""
    t_s = np.arange(500) * 0.005
    dp_mpa = 0.2 * np.sin(2 * np.pi * t_s)
    for name, gain in (("a", 150.0), ("b", 151.0), ("sick", 75.0), ("log/day", 150.0)):
        (tmp_path / name).mkdir(parents=True)
        with (tmp_path / name / "sine.csv").open("w", newline="") as file:
            rows = csv.writer(file)
            rows.writerow(("t_s", "dp_cmd_mpa", "angle_deg"))
            rows.writerows(zip(t_s, dp_mpa, gain * dp_mpa, strict=True))
    return tmp_path


def answers(value: object) -> Callable[..., object]:
    return lambda *_args, **_more: value


@pytest.mark.parametrize("name", COMMANDS)
def test_which_days_and_which_is_odd(name: str, days: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    words, work = COMMANDS[name]
    for module, function, value in work:
        monkeypatch.setattr(module, function, answers(value))
    compared = [part for day in ("a", "b", "sick") for part in ("--baseline", str(days / day))]
    call = [name, *(word.format(days) for word in words), *compared]
    done = CliRunner().invoke(gap, call, catch_exceptions=False)
    assert done.exit_code == 0, done.output
    for day in ("a", "b"):
        assert f"earlier day {days / day}: 1 record" in done.output
    assert f"earlier day {days / 'sick'}" not in done.output
    assert f"note: {days / 'sick'} is left out" in done.output
    done = CliRunner().invoke(gap, [*call, "--every-day"], catch_exceptions=False)
    assert f"earlier day {days / 'sick'}: 1 record" in done.output
    assert f"note: {days / 'sick'} disagrees with the other days" in done.output
