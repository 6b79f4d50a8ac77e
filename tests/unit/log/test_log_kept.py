"""What stays of a table that becomes a log: its times, ages and further channels, and exports of other versions."""

import json
import tracemalloc
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.records.made_logs import assert_same_samples, made_content, made_log

from rig.app.records.logs import contents_of, export_targets, exports, import_content
from rig.errors import RecordError
from rig.log.convert import read_content, write_content
from rig.log.exchange import SUFFIXES, export
from rig.log.mcap.collector import LogLine
from rig.log.mcap.columns import Samples
from rig.log.reader import read
from rig.sample import Sample

LATER = tuple(Sample._field_defaults)
"""Fields that version 0.2.0 did not have."""


@pytest.mark.parametrize("kind", ["csv", "csv.gz"])
def test_an_exported_table_without_its_facts_is_still_the_same_samples(tmp_path: Path, kind: str) -> None:
    content, path = made_content(300, missed_at=100), tmp_path / f"run{SUFFIXES[kind]}"
    export(content, path, kind)
    (tmp_path / f"{path.name}-metadata.json").unlink()
    back, unkept = import_content(path, None)
    assert_same_samples(back.samples, content.samples)
    assert (dict(back.result_facts), unkept) == ({}, [])  # whether it is valid nobody has said


def test_an_export_of_an_earlier_version_comes_in_whole(tmp_path: Path) -> None:
    """By its own columns; the fields that came later are filled in, as for an MCAP file."""
    content = made_content(50)
    export(content, tmp_path / "now.csv", "csv")
    names, *rows = [line.split(",") for line in (tmp_path / "now.csv").read_text().splitlines()]
    kept = [place for place, name in enumerate(names) if name not in LATER]
    path = tmp_path / "then.csv"
    path.write_text("".join(",".join(row[place] for place in kept) + "\n" for row in (names, *rows)))
    (tmp_path / "now.csv-metadata.json").rename(tmp_path / "then.csv-metadata.json")
    back, _ = import_content(path, None)
    fields = content.samples.fields | {name: np.full(50, np.nan) for name in LATER}
    assert_same_samples(back.samples, Samples(fields, content.samples.log_time_ns, content.samples.sequence))
    assert dict(back.run_facts) == dict(content.run_facts)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"log_time_ns": "1.79E+18"}, "row 2: log_time_ns: '1.79E.18' is not a whole number as it was exported"),
        ({"angle_deg": "x"}, "row 2: angle_deg: 'x' is not a number"),
    ],
)
def test_a_table_that_a_spreadsheet_changed_names_row_and_column(
    tmp_path: Path, change: dict[str, str], said: str
) -> None:
    path = tmp_path / "run.csv"
    export(made_content(3), path, "csv")
    names, first, *others = path.read_text().splitlines()
    cells = dict(zip(names.split(","), first.split(","), strict=True)) | change
    path.write_text("\n".join([names, ",".join(cells.values()), *others]) + "\n")
    with pytest.raises(RecordError, match=said):
        import_content(path, None)


def test_a_column_twice_in_an_export_is_named(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    export(made_content(3), path, "csv")
    path.write_text("".join(f"{line},{line.split(',')[0]}\n" for line in path.read_text().splitlines()))
    with pytest.raises(RecordError, match="'t_s' stands twice"):
        import_content(path, None)


def test_ages_and_the_first_time_stamp_of_a_table_stay(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    rows = "".join(f"{1.7e9 + 0.005 * k!r},0,{k},0.00{k},{k}\n" for k in range(4))
    path.write_text("t_s,dp_cmd_mpa,angle_deg,angle_age_s,woken_ns\n" + rows)
    content, unkept = import_content(path, None)
    assert content.samples["angle_age_ns"].tolist() == [0, 1_000_000, 2_000_000, 3_000_000]
    assert unkept == ["woken_ns"]
    write_content(content, tmp_path / "table.mcap")
    (record,) = read(tmp_path / "table.mcap")
    assert record.facts["t0_s"] == 1.7e9
    assert record.extra["angle_age_s"].tolist() == [0.0, 0.001, 0.002, 0.003]


def test_further_channels_stay_on_a_regular_grid_and_what_a_mapping_leaves_out_is_named(tmp_path: Path) -> None:
    (tmp_path / "mapping.yaml").write_text(
        json.dumps(
            {
                "columns": {"t_s": {"source": "t", "unit": "s"}, "dp_cmd_mpa": {"source": "u", "unit": "MPa"}},
                "further": {"load_n": {"source": "f", "unit": "N"}},
            }
        )
    )
    (tmp_path / "table.csv").write_text("t,u,f,note\n" + "".join(f"{0.007 * k!r},0,{k},x\n" for k in range(20)))
    content, unkept = import_content(tmp_path / "table.csv", tmp_path / "mapping.yaml")
    assert unkept == ["note"]
    write_content(content, tmp_path / "table.mcap")
    ((_, even),) = contents_of(tmp_path / "table.mcap", 0.005)
    known = 0.005 * np.arange(len(even.samples)) / 0.007 <= 19
    assert even.samples["further_1"][known] == pytest.approx(0.005 * np.flatnonzero(known) / 0.007)


def test_channels_of_a_tdms_file_that_are_none_of_ours_are_named(tmp_path: Path) -> None:
    nptdms = pytest.importorskip("nptdms")
    columns = {"t_s": np.arange(4) * 0.005, "dp_cmd_mpa": np.zeros(4), "load_n": np.ones(4)}
    with nptdms.TdmsWriter(tmp_path / "run.tdms") as file:
        file.write_segment([nptdms.ChannelObject("DAQ", name, values) for name, values in columns.items()])
    content, unkept = import_content(tmp_path / "run.tdms", None)
    assert (len(content.samples), unkept) == (4, ["DAQ/load_n"])


@pytest.mark.parametrize(("kind", "name"), [("csv", "run.parquet"), ("mat", "run.csv"), ("csv.gz", "run.csv")])
def test_an_export_is_not_called_what_it_is_not(tmp_path: Path, kind: str, name: str) -> None:
    with pytest.raises(RecordError, match=f"-o .*{name}: a {kind} file ends in .{kind}; --to says which kind"):
        export_targets([tmp_path / "run.mcap"], kind, tmp_path / name)
    right = tmp_path / f"out{SUFFIXES[kind]}"
    assert export_targets([tmp_path / "run.mcap"], kind, right) == [right]


def test_a_folder_is_exported_log_by_log(tmp_path: Path) -> None:
    """A day of records was in memory before the first was written."""
    for number in range(12):
        made_log(tmp_path / f"run_{number:02}.mcap", 2000, seed=number)
    files, peaks = sorted(tmp_path.glob("*.mcap")), []
    for some in (files[:1], files):
        tracemalloc.start()
        found = [
            (target.name, len(content.samples)) for target, content in exports(some, "mat", tmp_path / "out", None)
        ]
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        assert found == [(f"{file.stem}.mat", 2000) for file in some]
    assert peaks[1] < 2.5 * peaks[0]


def test_a_damaged_log_among_others_leaves_nothing_half_exported(tmp_path: Path) -> None:
    made_log(tmp_path / "a.mcap", 50)
    (tmp_path / "b.mcap").write_bytes((tmp_path / "a.mcap").read_bytes()[:-100])
    with pytest.raises(RecordError, match=r"b\.mcap"):
        next(exports(sorted(tmp_path.glob("*.mcap")), "csv", tmp_path / "out", None))


def test_two_records_are_not_exported_onto_one_file_nor_onto_one_that_stands(tmp_path: Path) -> None:
    one, other = (tmp_path / "run.mcap", tmp_path / "run.csv")
    with pytest.raises(RecordError, match=r"run\.mat: two records would be written there; -o FOLDER gives each"):
        export_targets([one, other], "mat", None)
    assert [place.name for place in export_targets([one, other], "mat", tmp_path)] == ["run.mat", "run_2.mat"]
    for name in ("a", "b"):
        made_log(tmp_path / f"{name}.mcap", 50)
    (tmp_path / "b.mat").touch()
    with pytest.raises(RecordError, match=r"b\.mat: exists already"):
        next(exports([tmp_path / "a.mcap", tmp_path / "b.mcap"], "mat", None, None))


def test_a_line_of_unknown_level_stays_one(tmp_path: Path) -> None:
    content = replace(made_content(3), lines=(LogLine(1_790_000_000_000_000_000, "unknown", "of another program"),))
    write_content(content, tmp_path / "run.mcap")
    assert read_content(tmp_path / "run.mcap").lines == content.lines
