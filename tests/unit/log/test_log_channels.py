"""Records of a rig with a channel map: in by a mapping, through our files, and what is refused."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from support.records.mapped_files import read_mapped

from rig.errors import ConfigError, RecordError
from rig.log.convert import content_of_record, unkept_columns, write_content
from rig.log.exchange import export, read_exported
from rig.log.foreign.mapping import load_mapping
from rig.log.reader import read, record_from_columns
from rig.record import Record

CHANNELS = {
    "input": {"name": "set_point", "unit": "mm", "range": [-50, 50]},
    "output": {"name": "position", "unit": "mm", "range": [-50, 50]},
}
COLUMNS = {
    "t_s": {"source": "time", "unit": "ms"},
    "input": {"source": "soll", "unit": "mm"},
    "output": {"source": "ist", "unit": "cm"},
}
FURTHER = {"load_n": {"source": "kraft", "unit": "N", "scale": 2.0, "same_within": 5.0}}


def mapping(folder: Path, **keys: object) -> Path:
    path = folder / "mapping.yaml"
    path.write_text(yaml.safe_dump({"columns": COLUMNS, "channels": CHANNELS} | keys), encoding="utf-8")
    return path


def table(folder: Path, period_ms: float = 7.3) -> Path:
    t = np.arange(400)
    rows = np.column_stack([period_ms * t, 40 * np.sin(0.05 * t), 3.9 * np.sin(0.05 * t - 0.1), 10 + 0.01 * t])
    path = folder / "sine.csv"
    np.savetxt(path, rows, delimiter=",", header="time,soll,ist,kraft", comments="", fmt="%.9g")
    return path


def imported(folder: Path, **keys: object) -> Record:
    path = table(folder)
    columns, facts = read_mapped(path, load_mapping(mapping(folder, **keys)))
    return record_from_columns(columns, facts, path)


def test_a_motors_record_comes_in_by_its_own_names_and_units(tmp_path: Path) -> None:
    record = imported(tmp_path)
    assert record.channels.input.column == "set_point_mm"
    assert record.period_s == pytest.approx(0.0073)
    assert record.angle_deg is not None
    own = record.channels.own_output(record.angle_deg)
    assert own[100] == pytest.approx(39 * np.sin(4.9), rel=1e-6)
    assert np.max(np.abs(record.dp_cmd_mpa)) == pytest.approx(0.16, rel=1e-3)


def test_further_channels_and_the_map_go_through_every_file_of_ours(tmp_path: Path) -> None:
    record = imported(tmp_path, further=FURTHER)
    assert unkept_columns(record) == []
    written = write_content(content_of_record(record, {}), tmp_path / "sine.mcap")
    (again,) = read(written)
    assert again.channels == record.channels
    assert np.array_equal(again.extra["load_n"], record.extra["load_n"])
    assert again.extra["load_n"][0] == 20.0
    for kind in ("csv", "parquet", "mat"):
        (out, *_) = export(content_of_record(record, {}), tmp_path / f"out.{kind}", kind)
        content = read_exported(out)
        if kind == "csv":
            table = np.genfromtxt(out, delimiter=",", names=True)
            assert table["position_mm"][100] == pytest.approx(39 * np.sin(4.9), rel=1e-6)
            assert {"set_point_mm", "load_n"} <= set(table.dtype.names or ())
            assert "[mm] by the rig's own name" in (tmp_path / "out.csv-metadata.json").read_text()
        assert content is not None
        assert content.run_facts["channels"] == record.facts["channels"]
        assert np.array_equal(content.samples["further_1"], record.extra["load_n"])


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"columns": {name: one for name, one in COLUMNS.items() if name != "input"}}, "'input' is missing"),
        ({"columns": COLUMNS | {"p1_mpa": {"source": "soll"}}}, "unknown column 'p1_mpa'"),
        ({"channels": CHANNELS | {"input": {"name": "x", "unit": "mm", "range": [5, -5]}}}, "is empty"),
        ({"channels": {"input": CHANNELS["input"]}}, "'output' is missing"),
        *(
            ({"further": {name: {"source": "kraft"}}}, f"'{name}' is there already")
            for name in ("angle_deg", "phase", "run", "tick", "p1_age_s", "log_time_ns", "units", "position_mm")
        ),
        ({"further": {"_load": {"source": "kraft"}}}, "'_load' begins with _"),
        ({"further": {f"x{number}": {"source": "kraft"} for number in range(5)}}, "place for 4"),
    ],
)
def test_a_map_that_is_none_is_refused(tmp_path: Path, keys: dict[str, object], said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        load_mapping(mapping(tmp_path, **keys))


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        ({"output": {"source": "ist", "unit": "m"}}, "reaches .* is it in another unit"),
        ({"output": {"source": "ist", "unit": "kg"}}, "'kg' does not fit 'mm'"),
        ({"input": {"source": "solll", "unit": "mm"}}, "did you mean 'soll'"),
    ],
)
def test_a_table_that_does_not_fit_its_map_is_refused(tmp_path: Path, columns: dict[str, object], said: str) -> None:
    with pytest.raises(RecordError, match=said):
        imported(tmp_path, columns=COLUMNS | columns)
