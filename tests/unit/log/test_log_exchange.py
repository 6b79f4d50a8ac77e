"""Exports of logs: round trips that lose nothing, whole files or none, and what is no count refused."""

import os
from pathlib import Path

import pytest
from support.records.made_logs import assert_same_content, made_content

from rig.app.records.logs import import_content
from rig.errors import RecordError, RigError
from rig.log import exchange
from rig.log.convert import LogContent
from rig.log.exchange import SUFFIXES, export, read_exported
from rig.log.mcap.columns import Array
from rig.log.reader import read


@pytest.mark.parametrize("kind", list(SUFFIXES))
@pytest.mark.parametrize("count", [1, 700])
def test_a_round_trip_loses_nothing(tmp_path: Path, kind: str, count: int) -> None:
    if kind == "parquet":
        pytest.importorskip("pyarrow")
    content = made_content(count)
    path = tmp_path / f"run{SUFFIXES[kind]}"
    export(content, path, kind)
    back = read_exported(path)
    assert back is not None
    assert_same_content(back, content)
    with pytest.raises(RecordError, match="exists already"):
        export(content, path, kind)


def test_an_exported_csv_is_a_log_like_any_other(tmp_path: Path) -> None:
    content = made_content(300)
    export(content, tmp_path / "run.csv", "csv")
    (record,) = read(tmp_path / "run.csv")
    assert (record.name, record.facts["session"], len(record)) == (
        "sine_0.5hz_0.20mpa",
        "12e4",
        int((content.samples["phase"] == 4).sum()),
    )


@pytest.mark.parametrize(
    ("name", "cells"),
    [
        *((name, ["", "nan", "-1", "2.5", "1e30"]) for name in ("tick", "missed", "flags", "phase")),
        ("woken_ns", ["", "2.5", "1e30"]),
        ("lateness_us", ["", "1e30"]),
    ],
)
def test_what_is_no_count_is_refused_and_not_made_another(tmp_path: Path, name: str, cells: list[str]) -> None:
    path = tmp_path / "table.csv"
    for cell in cells:
        path.write_text(f"t_s,dp_cmd_mpa,angle_deg,{name}\n0,0,0,1\n0.005,0,1,{cell}\n0.01,0.1,1,3\n")
        with pytest.raises(RecordError, match=rf"table.csv: {name}.* in row 2 is no whole number from"):
            import_content(path, None)


def test_an_export_whose_count_was_changed_is_refused(tmp_path: Path) -> None:
    arrow, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    path = tmp_path / "run.parquet"
    export(made_content(3), path, "parquet")
    table = parquet.read_table(path)
    place = table.schema.get_field_index("tick")
    parquet.write_table(table.set_column(place, "tick", arrow.array([0.0, float("nan"), 2.0])), path)
    with pytest.raises(RecordError, match="tick: nan in row 2 is no whole number from 0 to 4294967295"):
        read_exported(path)


@pytest.mark.parametrize("kind", ["csv", "parquet", "mat"])
def test_damaged_exports_are_refused(tmp_path: Path, kind: str) -> None:
    path = tmp_path / f"run{SUFFIXES[kind]}"
    export(made_content(50), path, kind)
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2])
    with pytest.raises(RecordError):
        read_exported(path)


@pytest.mark.parametrize("kind", ["csv", "csv.gz", "mat"])
def test_an_export_is_there_whole_or_not_at_all(tmp_path: Path, kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    content, path = made_content(50), tmp_path / f"run{SUFFIXES[kind]}"

    def interrupt(_: int) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr("os.fsync", interrupt)  # everything is written, nothing has its name
        with pytest.raises(KeyboardInterrupt):
            export(content, path, kind)
    assert [place for place in tmp_path.iterdir() if not place.name.endswith("-metadata.json")] == []


@pytest.mark.parametrize("kind", ["csv", "csv.gz"])
def test_of_two_exports_at_once_the_later_takes_nothing_from_the_other(
    tmp_path: Path, kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was refused, and took the facts of the first with it: the table stayed alone, under "a.csv: 50 rows"."""
    content, place, table = made_content(50), tmp_path / f"a{SUFFIXES[kind]}", exchange.file_columns

    def meanwhile(of: LogContent) -> dict[str, Array]:
        monkeypatch.setattr(exchange, "file_columns", table)
        export(content, place, kind)
        return table(of)

    monkeypatch.setattr(exchange, "file_columns", meanwhile)
    with pytest.raises(RigError, match="exists already"):
        export(made_content(60), place, kind)
    found = read_exported(place)
    assert found is not None
    assert_same_content(found, content)


def test_the_same_log_makes_the_same_packed_table(tmp_path: Path) -> None:
    content = made_content(50)
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        export(content, tmp_path / folder / "run.csv.gz", "csv.gz")
    assert (tmp_path / "a" / "run.csv.gz").read_bytes() == (tmp_path / "b" / "run.csv.gz").read_bytes()


@pytest.mark.parametrize("name", ["x.parquet", "x.mat", "x.csv"])
def test_a_pipe_is_not_waited_for(tmp_path: Path, name: str) -> None:
    os.mkfifo(tmp_path / name)
    (tmp_path / f"{name}-metadata.json").write_text("{}")
    with pytest.raises(RecordError, match="not a regular file"):
        read_exported(tmp_path / name)


def test_nor_is_one_in_the_place_of_the_facts(tmp_path: Path) -> None:
    export(made_content(50), tmp_path / "run.csv", "csv")
    aside = tmp_path / "run.csv-metadata.json"
    aside.unlink()
    os.mkfifo(aside)
    with pytest.raises(RecordError, match="not a regular file"):
        read(tmp_path / "run.csv")


def test_a_table_without_end_is_not_read(tmp_path: Path) -> None:
    with (tmp_path / "x.csv").open("wb") as file:
        file.truncate(1 << 40)
    with pytest.raises(RecordError, match="allowed are"):
        read(tmp_path / "x.csv")
