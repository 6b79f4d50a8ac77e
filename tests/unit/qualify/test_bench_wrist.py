"""The benchmark on the real wrist, shortened: what is put in comes back, and nothing is said of the joint as it is."""

from pathlib import Path

import pytest

from rig.errors import RecordError
from rig.qualify.benchmarks import wrist


def test_what_is_put_into_the_wrists_record_is_found(shared: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = shared / "real" / "porcaro_wrist"
    if not (folder / wrist.SWEEP).is_file():
        pytest.skip("the records of the real joint are not part of the project")
    monkeypatch.setenv("PAMRIG_WRIST", str(folder))
    monkeypatch.setattr(wrist, "REPEATS", 1)
    monkeypatch.setattr(
        wrist, "CASES", [case for case in wrist.CASES if case[:2] in (("delay", 0.03), ("quantisation", 4.0))]
    )
    rows = wrist.bench_wrist()
    for mode in ("pressures", "angle"):
        assert rows[f"exact name first, {mode}"]["value"] == 100.0
        assert rows[f"size, median error, {mode}"]["value"] < 5.0
        assert rows[f"false alarms, {mode}"]["value"] == 0.0


def test_without_its_records_it_says_where_they_are_looked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(RecordError, match=r"bench wrist: no exp3.*PAMRIG_WRIST"):
        wrist.bench_wrist()
