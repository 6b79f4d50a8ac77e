"""Tables and channels of others by a mapping: units, scales, and everything ambiguous refused."""

import gzip
import json
from pathlib import Path

import numpy as np
import pytest
from google.protobuf import descriptor_pool, message_factory
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from mcap.writer import Writer
from support.records.mapped_files import read_mapped

from rig.app.records.logs import import_content
from rig.errors import ConfigError, RecordError
from rig.log.convert import write_content
from rig.log.foreign.mapping import load_mapping
from rig.log.foreign.units import conversion
from rig.log.mcap import schema
from rig.log.mcap.columns import Array
from rig.log.reader import read_samples

TIME = {"t_s": {"source": "t", "unit": "s"}}


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
