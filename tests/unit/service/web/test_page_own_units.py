"""The page of a rig in mm: rows, figures, records and the history of its diagnoses in its own unit."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.records.made_logs import made_log

from rig.channels import FACT, Channel, Channels
from rig.errors import RecordError
from rig.log.convert import write_record
from rig.record import Record
from rig.service.web.files import curves
from rig.service.web.files.diagnoses import Diagnoses, DiagnosisRequest
from rig.service.web.files.diagnosis_json import DiagnosedDay
from rig.service.web.files.history import history_json
from rig.service.web.files.records import SessionFolders
from rig.service.web.stream.feed import COLUMNS, Feed
from rig.service.web.stream.shown_status import own_now
from rig.service.web.units import units_of

MOTOR = Channels(Channel("set_point", "mm", (-20.0, 80.0)), Channel("position", "mm", (-20.0, 80.0)))


def motor(folder: Path, name: str, late_s: float = 0.0) -> Path:
    t = 0.01 * np.arange(400)
    wanted, answered = (30.0 + 40.0 * np.sin(3.0 * (t - late)) for late in (0.0, late_s))
    facts = {FACT: MOTOR.plain()}
    record = Record(name, t, MOTOR.working_input(wanted), MOTOR.working_output(answered), facts=facts)
    write_record(record, folder / f"{name}.mcap", {})
    return folder / f"{name}.mcap"


def test_rows_and_figures_are_absolute_in_mm_and_differences_without_the_middle() -> None:
    feed = Feed(0.01, None, own=MOTOR)
    columns: dict[str, Any] = {"p1_cmd_mpa": [0.3], "p1_mpa": [0.3], "p2_cmd_mpa": [0.1], "p2_mpa": [0.1]}
    feed.add({"tick": [0], **columns, "angle_deg": [8.0], "phase": ["sweep"]})
    row = dict(zip(COLUMNS, feed.fine[0], strict=True))
    assert (row["input"], row["output"]) == (80.0, 50.0)
    assert {row[name] for name in columns} == {None}
    loop = {"p1_cmd_mpa": 0.3, "p2_cmd_mpa": 0.1, "angle_deg": 8.0}
    assert own_now({"loop": loop, FACT: MOTOR.plain()}) == {"input": pytest.approx(80.0), "output": 50.0}
    assert own_now({"loop": None, FACT: None}) == {"input": None, "output": None}


def test_a_record_and_a_comparison_are_shown_in_mm(tmp_path: Path) -> None:
    first, second = motor(tmp_path, "first"), motor(tmp_path, "second", 0.03)
    shown = curves.record(first)
    assert shown["units"] == units_of(MOTOR)
    assert shown["columns"].keys() == {"t_s", "input", "output"}
    assert max(shown["columns"]["output"]) == pytest.approx(70.0, abs=0.1)
    beside = curves.compared(first, second)
    assert beside["max"] == pytest.approx(40.0 * 3.0 * 0.03, abs=0.05)
    assert max(map(abs, beside["difference"])) == pytest.approx(beside["max"], abs=1e-3)
    made_log(tmp_path / "pneumatic.mcap")
    with pytest.raises(RecordError, match="different rigs"):
        curves.compared(first, tmp_path / "pneumatic.mcap")


def diagnosis(gap: float, play: float | None, unit: str = "mm") -> dict[str, Any]:
    size = {"value": play, "low": (play or 0) - 0.2, "high": (play or 0) + 0.2, "unit": unit}
    causes = [] if play is None else [{"effect": "backlash", "parameters": {"width_deg": size}}]
    channels = {} if unit == "deg" else {FACT: MOTOR.plain()}
    return {"verdict": "explained", "gap": {f"rms_{unit}": gap, f"floor_{unit}": 0.2}, "causes": causes, **channels}


def test_the_history_finds_the_day_of_a_change_and_says_it_in_mm() -> None:
    each = [diagnosis(0.2 + 2.0 * (n >= 6) + 0.01 * n, None if n < 6 else 4.0) for n in range(12)]
    days = [DiagnosedDay(f"day {n:02d}", 86400.0 * n, found) for n, found in enumerate(each)]
    told = history_json([*days[6:], *days[:6], DiagnosedDay("another rig", -1.0, diagnosis(1.0, None, "deg"))])
    assert [day["name"] for day in told["days"]] == [day.session for day in days]
    assert told["effects"] == {"backlash": "mm"}
    changed = {change["quantity"]: change["day"] for change in told["changes"]}
    assert changed == {"gap_deg": "day 06", "backlash": "day 06"}
    assert "mm on day 06" in told["words"][0]
    assert history_json([])["days"] == []
    assert history_json(days[:1])["words"] == []


def test_the_newest_diagnosis_of_a_session_counts_and_only_of_what_was_asked(tmp_path: Path) -> None:
    asked_for = (("a", "day", "auto", 1.0), ("b", "day", "auto", 2.0), ("c", "day", "session", 3.0))
    for name, session, reference, gap in (*asked_for, ("d", "other", "auto", 4.0)):
        (tmp_path / name).mkdir()
        asked = asdict(DiagnosisRequest(session, "m", reference, (), 5.0, 7.0))
        (tmp_path / name / "asked.json").write_text(json.dumps(asked))
        (tmp_path / name / "found.json").write_text(json.dumps(diagnosis(gap, None)))
    (tmp_path / "e").mkdir()
    found = {one.session: one for one in Diagnoses(tmp_path).days("m", "auto")}
    assert {name: one.found["gap"]["rms_mm"] for name, one in found.items()} == {"day": 2.0, "other": 4.0}
    assert found["day"].recorded_s == 7.0
    assert Diagnoses(tmp_path).all()[1]["gap"] == 4.0


def test_a_session_is_as_old_as_its_name_or_its_oldest_file_says(tmp_path: Path) -> None:
    for name in ("20260301T120000Z_paper", "loose_name", "20269999T120000Z_x"):
        (tmp_path / name).mkdir()
        made_log(tmp_path / name / "a.mcap")
    records = SessionFolders(tmp_path)
    assert records.recorded_s("20260301T120000Z_paper") == 1772366400.0
    for name in ("loose_name", "20269999T120000Z_x"):
        assert records.recorded_s(name) == (tmp_path / name / "a.mcap").stat().st_mtime
