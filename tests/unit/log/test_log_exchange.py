"""Logs to and from other formats: round trips that lose nothing, mappings, units, and everything ambiguous refused."""

import gzip
import json
import os
from pathlib import Path

import numpy as np
import pytest
from google.protobuf import descriptor_pool, message_factory
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from mcap.writer import Writer
from support.records.made_logs import assert_same_content, made_content

from rig.app.records.logs import import_content
from rig.errors import ConfigError, RecordError
from rig.log.convert import write_content
from rig.log.exchange import SUFFIXES, export, read_exported
from rig.log.foreign.mapping import load_mapping, read_mapped
from rig.log.foreign.units import conversion
from rig.log.mcap import schema
from rig.log.mcap.columns import Array
from rig.log.reader import read, read_samples

TIME = {"t_s": {"source": "t", "unit": "s"}}


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


def mapping(tmp_path: Path, **keys: object) -> Path:
    path = tmp_path / "mapping.yaml"
    path.write_text(json.dumps(keys))
    return path


def mapped(tmp_path: Path, table: Path, **keys: object) -> dict[str, Array]:
    return read_mapped(table, load_mapping(mapping(tmp_path, **keys)))[0]


def test_a_german_labview_export(tmp_path: Path) -> None:
    table = tmp_path / "messung.csv"
    table.write_text("LabVIEW\n\nZeit (ms);Soll (bar);Druck 1 (kPa);Winkel (rad)\n0;0,5;200,5;0,1\n5;-1,5;300;\n")
    columns = mapped(
        tmp_path,
        table,
        separator=";",
        decimal=",",
        skip_rows=1,
        columns={
            "t_s": {"source": "Zeit (ms)", "unit": "ms"},
            "dp_cmd_mpa": {"source": "Soll (bar)", "unit": "bar"},
            "p1_mpa": {"source": "Druck 1 (kPa)", "unit": "kPa"},
            "angle_deg": {"source": "Winkel (rad)", "unit": "rad"},
        },
    )
    assert columns["t_s"].tolist() == [0, 0.005]
    assert columns["dp_cmd_mpa"].tolist() == [0.05, -0.15]
    assert columns["p1_mpa"].tolist() == [0.2005, 0.3]
    assert columns["angle_deg"][0] == pytest.approx(5.729577951)
    assert np.isnan(columns["angle_deg"][1])


def test_scale_and_offset_come_before_the_unit(tmp_path: Path) -> None:
    table = tmp_path / "volts.csv"
    table.write_text("u\n1.0\n5.0\n")
    source = {"source": "u", "scale": 125.0, "offset": -125.0, "unit": "kPa"}
    columns = mapped(tmp_path, table, period_s=0.01, columns={"dp_cmd_mpa": source})
    assert columns["dp_cmd_mpa"].tolist() == [0.0, 0.5]
    assert columns["t_s"].tolist() == [0.0, 0.01]


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"columns": {"dp_cmd_mpa": {"source": "u", "unit": "bar"}}}, "either the column t_s or period_s"),
        ({"period_s": 0.01, "columns": TIME | {"dp_cmd_mpa": {"source": "u"}}}, "either the column t_s or period_s"),
        ({"columns": TIME | {"angle": {"source": "u"}}}, "unknown column 'angle'; did you mean 'angle_"),
        ({"columns": TIME, "separator": ",", "decimal": ","}, "must differ"),
        ({"columns": TIME, "separator": ";;"}, "one character"),
        ({"columns": ["t_s"]}, "expected `columns:`, a mapping"),
        ({"columns": {"t_s": "t"}}, "columns"),
        ({"columns": TIME, "facts": 3}, "facts"),
        ({"columns": TIME, "decimals": ","}, "unknown key 'decimals'"),
    ],
)
def test_mappings_that_do_not_fit_themselves(tmp_path: Path, keys: dict[str, object], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        load_mapping(mapping(tmp_path, **keys))


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ({"source": "u"}, "no unit is stated for dp_cmd_mpa"),
        ({"source": "v", "unit": "bar"}, "no column 'v'"),
        (
            {"source": "u", "unit": "mPa"},
            "the unit 'mPa' does not fit dp_cmd_mpa; allowed: MPa, kPa, Pa, bar, mbar, psi",
        ),
        ({"source": "u", "unit": "deg"}, "the unit 'deg' does not fit dp_cmd_mpa"),
    ],
)
def test_what_is_ambiguous_is_refused(tmp_path: Path, source: dict[str, object], message: str) -> None:
    table = tmp_path / "t.csv"
    table.write_text("t,u\n0,1\n")
    with pytest.raises(RecordError, match=message):
        mapped(tmp_path, table, columns=TIME | {"dp_cmd_mpa": source})


@pytest.mark.parametrize(
    ("unit", "column", "value"),
    [
        ("psi", "p1_mpa", 0.006894757293168361),
        ("mbar", "p1_mpa", 1e-4),
        ("mrad", "angle_deg", 0.0572957795),
        ("ns", "t_s", 1e-9),
    ],
)
def test_units(unit: str, column: str, value: float) -> None:
    _, times, by = conversion(column, unit, "here")
    assert times / by == pytest.approx(value, rel=1e-9)


def tdms(path: Path, channels: dict[str, tuple[list[float], dict[str, object]]], groups: int = 1) -> Path:
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(str(path)) as writer:
        for group in range(groups):
            writer.write_segment(
                [
                    nptdms.ChannelObject(f"run{group}", name, np.array(values), properties=properties)
                    for name, (values, properties) in channels.items()
                ]
            )
    return path


BAR = {"unit_string": "bar"}


def test_tdms_by_its_own_names_and_units(tmp_path: Path) -> None:
    path = tdms(
        tmp_path / "run.tdms",
        {
            "t": ([0.0, 5.0, 10.0], {"unit_string": "ms"}),
            "dp_cmd": ([0.0, 1.0, 2.0], BAR),
            "p1": ([2.0, 2.5, 3.0], BAR),
            "angle_deg": ([0.0, 1.0, 2.0], {}),
        },
    )
    (record,) = read(path)
    assert record.t_s.tolist() == [0, 0.005, 0.01]
    assert record.dp_cmd_mpa.tolist() == [0, 0.1, 0.2]
    assert record.p1_mpa is not None
    assert record.p1_mpa.tolist() == [0.2, 0.25, 0.3]


def test_tdms_waveforms_carry_their_time(tmp_path: Path) -> None:
    wave = {"wf_increment": 0.005, "wf_start_offset": 0.0}
    path = tdms(tmp_path / "run.tdms", {"dp_cmd_mpa": ([0.0, 0.1], wave), "angle_deg": ([0.0, 1.0], wave)})
    assert read(path)[0].t_s.tolist() == [0, 0.005]


BEGUN = np.datetime64("2026-03-04T10:11:12.345678")
BEGUN_NS = int(BEGUN.astype(np.int64)) * 1000


@pytest.mark.parametrize(
    ("offset_s", "begun", "started_ns"),
    [(0.0, BEGUN, BEGUN_NS), (0.25, BEGUN, BEGUN_NS + 250_000_000), (0.0, np.datetime64("1904-01-01", "us"), None)],
)
def test_when_a_waveform_began_is_kept(
    tmp_path: Path, offset_s: float, begun: np.datetime64, started_ns: int | None
) -> None:
    """It was lost, and the log said 1970; a clock that nobody set says 1904, which is no time of a record."""
    wave = {"wf_increment": 0.005, "wf_start_offset": offset_s, "wf_start_time": begun}
    path = tdms(tmp_path / "run.tdms", {"dp_cmd_mpa": ([0.0, 0.1], wave), "angle_deg": ([0.0, 1.0], wave)})
    assert read(path)[0].facts.get("started_ns") == started_ns
    log = write_content(import_content(path, None)[0], tmp_path / "run.mcap")
    assert read_samples(log).log_time_ns.tolist() == [started_ns or 0, (started_ns or 0) + 5_000_000]


def test_a_channel_of_time_stamps_is_a_time(tmp_path: Path) -> None:
    stamps = BEGUN + np.array([0, 5000, 10_100]).astype("timedelta64[us]")
    columns = {"t": stamps, "dp_cmd_mpa": np.zeros(3), "angle_deg": np.arange(3.0)}
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(tmp_path / "run.tdms") as file:
        file.write_segment([nptdms.ChannelObject("DAQ", name, values) for name, values in columns.items()])
    (record,) = read(tmp_path / "run.tdms")
    assert record.t_s.tolist() == [0, 0.005, 0.0101]
    assert record.facts["started_ns"] == BEGUN_NS


@pytest.mark.parametrize(("later_us", "refused"), [(2000, True), (100, False)])
def test_channels_that_begin_at_other_times_are_no_table(tmp_path: Path, later_us: int, refused: bool) -> None:
    first, later = ({"wf_increment": 0.005, "wf_start_time": BEGUN + np.timedelta64(us, "us")} for us in (0, later_us))
    path = tdms(tmp_path / "run.tdms", {"dp_cmd_mpa": ([0.0, 0.1], first), "angle_deg": ([0.0, 1.0], later)})
    if not refused:
        assert read(path)[0].t_s.tolist() == [0, 0.005]
        return
    with pytest.raises(RecordError, match=r"different start: run0/angle_deg begins 0\.002 s after run0/dp_cmd_mpa"):
        read(path)


@pytest.mark.parametrize(
    ("channels", "groups", "message"),
    [
        (
            {"t_s": ([0.0, 1.0], {}), "dp_cmd_mpa": ([0.0, 1.0], BAR)},
            1,
            "named in MPa and its unit property says 'bar'",
        ),
        ({"t_s": ([0.0, 1.0], {}), "dp_cmd_mpa": ([0.0], {})}, 1, "different length"),
        ({"t_s": ([0.0, 1.0], {}), "dp_cmd_mpa": ([0.0, 1.0], {})}, 2, "t_s is ambiguous: run0/t_s and run1/t_s"),
        ({"t_s": ([0.0, 1.0], {}), "dp_cmd": ([0.0, 1.0], {})}, 1, "no column dp_cmd_mpa"),
        ({"a": ([0.0, 1.0], {"wf_increment": 0.1}), "b": ([0.0, 1.0], {"wf_increment": 0.2})}, 1, "different rate"),
    ],
)
def test_ambiguous_tdms_is_refused(
    tmp_path: Path, channels: dict[str, tuple[list[float], dict[str, object]]], groups: int, message: str
) -> None:
    with pytest.raises(RecordError, match=message):
        read(tdms(tmp_path / "run.tdms", channels, groups))


@pytest.mark.parametrize("kept", [3, 40, 200, 430])
def test_a_cut_tdms(tmp_path: Path, kept: int) -> None:
    path = tdms(tmp_path / "run.tdms", {"t_s": ([0.0, 1.0] * 20, {}), "dp_cmd_mpa": ([0.0, 1.0] * 20, {})})
    data = path.read_bytes()
    assert len(data) > 430
    path.write_bytes(data[:kept])
    with pytest.raises(RecordError):
        read(path)


def json_mcap(path: Path, messages: list[bytes], encoding: str = "json") -> Path:
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        channel = writer.register_channel("/joint", encoding, writer.register_schema("Joint", "jsonschema", b"{}"))
        for number, message in enumerate(messages):
            writer.add_message(channel, 1_000_000_000 + number * 5_000_000, message, 0)
        writer.finish()
    return path


def test_another_programs_json_channel(tmp_path: Path) -> None:
    messages = [json.dumps({"cmd": {"dp": k * 10.0}, "angle": k, "note": "x"}).encode() for k in range(3)]
    columns = mapped(
        tmp_path,
        json_mcap(tmp_path / "f.mcap", messages),
        topic="/joint",
        columns={
            "t_s": {"source": "log_time"},
            "dp_cmd_mpa": {"source": "cmd.dp", "unit": "kPa"},
            "angle_deg": {"source": "angle", "unit": "deg"},
        },
    )
    assert columns["t_s"].tolist() == [0, 0.005, 0.01]
    assert columns["dp_cmd_mpa"].tolist() == [0, 0.01, 0.02]


def test_when_another_programs_channel_began_is_kept(tmp_path: Path) -> None:
    path = json_mcap(tmp_path / "f.mcap", [json.dumps({"cmd": k, "angle": k}).encode() for k in range(3)])
    columns = {"t_s": "log_time", "dp_cmd_mpa": "cmd", "angle_deg": "angle"}
    units = {"t_s": "s", "dp_cmd_mpa": "kPa", "angle_deg": "deg"}
    (tmp_path / "m.yaml").write_text(
        json.dumps({"topic": "/joint", "columns": {k: {"source": v, "unit": units[k]} for k, v in columns.items()}})
    )
    log = write_content(import_content(path, tmp_path / "m.yaml")[0], tmp_path / "run.mcap")
    assert read_samples(log).log_time_ns.tolist() == [1_000_000_000, 1_005_000_000, 1_010_000_000]


def test_another_programs_protobuf_channel(tmp_path: Path) -> None:
    descriptors = schema.descriptor_set(schema.REPLAY_SCHEMA, schema.REPLAY_WIRES)
    pool = descriptor_pool.DescriptorPool()
    for file in FileDescriptorSet.FromString(descriptors).file:
        pool.AddSerializedFile(file.SerializeToString())
    kind = message_factory.GetMessageClass(pool.FindMessageTypeByName(schema.REPLAY_SCHEMA))
    with (tmp_path / "f.mcap").open("wb") as out:
        writer = Writer(out)
        writer.start()
        channel = writer.register_channel(
            "/x", "protobuf", writer.register_schema(schema.REPLAY_SCHEMA, "protobuf", descriptors)
        )
        for number in range(3):
            writer.add_message(channel, number, kind(tick=number, angle_deg=2.0 * number).SerializeToString(), number)
        writer.finish()
    sources = {"t_s": {"source": "tick", "unit": "ms"}, "angle_deg": {"source": "angle_deg"}}
    columns = mapped(tmp_path, tmp_path / "f.mcap", topic="/x", columns=sources)
    assert columns["t_s"].tolist() == [0, 0.001, 0.002]
    assert columns["angle_deg"].tolist() == [0, 2, 4]


@pytest.mark.parametrize(
    ("messages", "encoding", "topic", "message"),
    [
        ([b"{}"], "json", "/other", r"no messages on topic '/other'; it has /joint \(json, Joint\)"),
        ([b"{"], "json", "/joint", "not what its channel says"),
        ([b'{"a": 1e999999}'], "json", "/joint", "no column"),
        ([b"x"], "cdr", "/joint", "encoded as 'cdr'; json and protobuf can be imported"),
    ],
)
def test_channels_that_cannot_be_imported(
    tmp_path: Path, messages: list[bytes], encoding: str, topic: str, message: str
) -> None:
    path = json_mcap(tmp_path / "f.mcap", messages, encoding)
    with pytest.raises(RecordError, match=message):
        mapped(
            tmp_path,
            path,
            topic=topic,
            columns={"t_s": {"source": "log_time"}, "dp_cmd_mpa": {"source": "u", "unit": "bar"}},
        )


def test_a_gzipped_table_by_a_mapping(tmp_path: Path) -> None:
    (tmp_path / "t.csv.gz").write_bytes(gzip.compress(b"t\tu\n0\t1\n1\t2\n"))
    source = {"source": "u", "unit": "bar"}
    columns = mapped(tmp_path, tmp_path / "t.csv.gz", separator="\t", columns=TIME | {"dp_cmd_mpa": source})
    assert columns["dp_cmd_mpa"].tolist() == [0.1, 0.2]


def test_the_real_wrist_comes_in_by_a_mapping(tmp_path: Path, shared: Path) -> None:
    """50 Hz, irregular stamps, pressures below zero: nothing of it is smoothed or refused."""
    table = shared / "real" / "porcaro_wrist" / "exp2_step_20260211_subsampled.csv"
    columns = mapped(
        tmp_path,
        table,
        columns={
            "t_s": {"source": "t_s"},
            "p1_cmd_mpa": {"source": "u_cmd_DF_MPa", "unit": "MPa"},
            "p2_cmd_mpa": {"source": "u_cmd_F_MPa", "unit": "MPa"},
            "p1_mpa": {"source": "y_meas_DF_MPa", "unit": "MPa"},
            "angle_deg": {"source": "y_wrist_angle_deg"},
        },
    )
    assert len(columns["t_s"]) == 126
    assert columns["p1_mpa"][0] == -0.012
    assert np.ptp(np.diff(columns["t_s"])) > 0.01


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
