"""A motor in mm at 10 ms by the commands, from a table of its own to its history: nowhere a degree or an MPa."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from click.testing import CliRunner

from rig.cli.commands import cli

FOREIGN = re.compile(r"\b(deg|degrees|MPa|kPa|angle|p1 - p2)\b|_deg\b|_mpa\b")
UNITS = re.compile(r"_(deg|mpa|kpa)(_|$)")
PERIOD_S = 0.01
MIDDLE_MM = 30.0
MAPPING = {
    "columns": {
        "t_s": {"source": "time", "unit": "ms"},
        "input": {"source": "soll", "unit": "mm"},
        "output": {"source": "ist", "unit": "mm"},
    },
    "channels": {
        "input": {"name": "set_point", "unit": "mm", "range": [-20, 80]},
        "output": {"name": "position", "unit": "mm", "range": [-20, 80]},
    },
}
DAYS = {"20260301": 0.0, "20260302": 0.0, "20260303": 6.0}
"""Play behind the motor on each day, mm."""


def table(hertz: float, seed: int, play_mm: float) -> np.ndarray:
    """Time (ms), set-point and position (mm): a first-order loop with friction and play behind it."""
    t = PERIOD_S * np.arange(round(8.0 / PERIOD_S))
    wanted = MIDDLE_MM + 40.0 * np.sin(2 * np.pi * hertz * t)
    loop, out = np.full_like(t, MIDDLE_MM), np.full_like(t, MIDDLE_MM)
    for k in range(1, len(t)):
        loop[k] = loop[k - 1] + PERIOD_S / 0.05 * (wanted[k - 1] - loop[k - 1])
        out[k] = min(max(out[k - 1], loop[k] - 0.5 * play_mm - 0.3), loop[k] + 0.5 * play_mm + 0.3)
    return np.column_stack([1e3 * t, wanted, out + np.random.default_rng(seed).normal(0.0, 0.05, len(t))])


def called(*words: object) -> str:
    done = CliRunner().invoke(cli, [str(word) for word in words])
    assert done.exit_code == 0, f"{done.output} {done.exception!r}"
    return done.output


@pytest.fixture(scope="module")
def motor(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a day of records in each folder of days/, and a model of the first."""
    folder = tmp_path_factory.mktemp("motor")
    (folder / "mapping.yaml").write_text(yaml.safe_dump(MAPPING))
    for seed, (day, play_mm) in enumerate(DAYS.items()):
        (folder / "days" / day).mkdir(parents=True)
        for number, hertz in enumerate((0.25, 0.5)):
            raw = folder / f"sine_{hertz}hz.csv"
            rows = table(hertz, 10 * seed + number, play_mm)
            np.savetxt(raw, rows, delimiter=",", header="time,soll,ist", comments="", fmt="%.6f")
            out = folder / "days" / day / f"{raw.stem}.mcap"
            called("log", "import", raw, "--mapping", folder / "mapping.yaml", "-o", out)
    size = ("--seeds", 1, "--particles", 20, "--iterations", 30)
    said = called("identify", folder / "days" / "20260301", "-o", folder / "model.yaml", *size)
    assert not FOREIGN.search(without_parameters(said)), said
    assert not re.search("mean pressure|muscle|valve", said), said
    assert re.search(r"RMSE \d+\.\d+ mm \(\d+\.\d+ mm before the polish\)", said), said
    assert re.search(r"position at most \d+\.\d mm from the middle of its range in \w+_[\d.]+hz_[\d.]+mm", said)
    return folder


def without_parameters(said: str) -> str:
    """What identify says but for the table of parameters, which are the model file's own numbers."""
    return "\n".join(line for line in said.splitlines() if not re.match(r"\s*(?:\S+_(?:deg|mpa)|theta|u_unit)", line))


def known(folder: Path, *words: object) -> tuple[str, dict[str, Any]]:
    """What a command says, and its JSON; neither may know a degree."""
    said = called(*words, "--json", folder / "said.json")
    assert not FOREIGN.search(said), said
    plain = json.loads((folder / "said.json").read_text())
    return said, plain


def keys(plain: Any) -> set[str]:
    """Every key of JSON, however deep, but for what is a model's or a file's own."""
    if isinstance(plain, list):
        return {key for item in plain for key in keys(item)}
    if not isinstance(plain, dict):
        return set()
    inside = {
        key
        for name, item in plain.items()
        if name not in ("added_to_model", "config", "fingerprint")
        for key in keys(item)
    }
    return {*plain, *inside}


def test_records_are_told_and_compared_in_mm(motor: Path, tmp_path: Path) -> None:
    now, before = motor / "days" / "20260303", motor / "days" / "20260302"
    assert "position [mm]" in called("log", "plot", now / "sine_0.5hz.mcap")
    assert not FOREIGN.search(called("log", "info", now))
    said, plain = known(tmp_path, "log", "compare", now, before, "-o", tmp_path)
    assert "RMS mm" in said
    (slow, _) = plain["records"]
    assert slow["columns"].keys() == {"set_point_mm", "position_mm"}
    assert slow["rmse_mm"] == pytest.approx(2.9, abs=0.4)
    assert plain["channels"] == MAPPING["channels"]
    assert not {key for key in keys(plain) if UNITS.search(key)}
    far = CliRunner().invoke(cli, ["log", "compare", str(now), str(before), "--within", "1"])
    assert re.search(r"differs by [\d.]+ mm, allowed 1", str(far.exception))
    assert not FOREIGN.search((tmp_path / "sine_0.5hz.svg").read_text().partition("<!--")[2])


def test_the_model_predicts_and_simulates_at_its_own_period(motor: Path, tmp_path: Path) -> None:
    assert yaml.safe_load((motor / "model.yaml").read_text())["sample_time_s"] == PERIOD_S
    said, plain = known(tmp_path, "validate", motor / "model.yaml", motor / "days" / "20260302")
    assert plain["records"][0]["rmse_mm"] < 1.0
    assert "RMSE mm" in said
    said, plain = known(
        tmp_path, "simulate", motor / "days" / "20260302", "--model", motor / "model.yaml", "-o", tmp_path / "sim"
    )
    assert plain["runs"][0]["rmse_mm"] < 1.0
    _, beside = known(tmp_path, "log", "compare", motor / "days" / "20260302", tmp_path / "sim")
    assert beside["rmse_mm"] < 1.0
    again = ("replay", motor / "days" / "20260302" / "sine_0.5hz.mcap", "--model", motor / "model.yaml")
    said, plain = known(tmp_path, *again, "-o", tmp_path / "again.mcap")
    assert plain["runs"][0]["rmse_mm"] < 1.0
    assert not {key for key in keys(plain) if UNITS.search(key)}


def test_the_play_is_named_in_mm_and_over_the_days(motor: Path, tmp_path: Path) -> None:
    days = motor / "days"
    call = ("--model", motor / "model.yaml", "--baseline", days / "20260301")
    said, plain = known(tmp_path, "gap", "diagnose", *call, "--log", days / "20260303", "--html", tmp_path / "gap.html")
    assert plain["causes"][0]["effect"] in ("backlash", "coulomb_friction")
    assert " mm" in said
    assert not {key for key in keys(plain) if UNITS.search(key)}
    said, plain = known(tmp_path, "gap", "history", days, *call[:2], "--workers", 1, "-o", tmp_path / "h.svg")
    assert {"gap_mm", "floor_mm"} <= plain["days"][2].keys()
    assert plain["days"][2]["gap_mm"] > 2 * plain["days"][1]["gap_mm"]
    assert not {key for key in keys(plain) if UNITS.search(key)}


def test_what_it_can_tell_is_said_in_mm_and_a_session_is_designed_on_its_own_grid(motor: Path, tmp_path: Path) -> None:
    record = "{sine: {frequency_hz: 0.5, amplitude_mpa: 0.2}}"
    (tmp_path / "short.yaml").write_text(f"{{settle_s: 1, duration_s: 6, records: [{record}]}}")
    said, plain = known(tmp_path, "gap", "capability", motor / "model.yaml", "--sweep", tmp_path / "short.yaml")
    assert {"backlash", "delay"} < plain["effects"].keys()
    assert not {"valve_lag", "valve_gain", "co_contraction", "leak"} & plain["effects"].keys()
    assert plain["effects"]["backlash"]["unit"] == "mm"
    assert 0.1 < plain["effects"]["backlash"]["detectable"] < 5.0
    assert plain["channels"] == MAPPING["channels"]
    assert not re.search("data sheet|ITV", said), said
    called("gap", "design", motor / "model.yaml", "--minutes", 0.5, "-o", tmp_path / "session.yaml")
    assert "0.2 MPa are 50 mm of the set point" in (tmp_path / "session.yaml").read_text()
    plants = ("gap", "design", motor / "model.yaml", "--family", "mckibben", "-o", tmp_path / "no.yaml")
    refused = CliRunner().invoke(cli, [str(word) for word in plants])
    assert "plant families are pneumatic joints" in str(refused.exception)
