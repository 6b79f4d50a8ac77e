"""Reading logs: phases, names, sessions, slices of time, files of other versions, and every bad file in one clear
line."""

import errno
import gzip
import os
import struct
import tracemalloc
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from google.protobuf import descriptor_pool, message_factory
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from mcap.writer import CompressionType, Writer
from support.records.made_logs import assert_same_samples, made_content, made_log, made_samples

from rig.app.records.logs import found_or_unfinished
from rig.errors import RecordError
from rig.log.convert import read_content, write_content, write_record
from rig.log.exchange import export
from rig.log.mcap import schema
from rig.log.mcap.columns import Samples, pack_columns
from rig.log.mcap.framing import MAGIC
from rig.log.mcap.reader import McapLog, read_stretch
from rig.log.reader import read, read_samples
from rig.sample import WIRES, Phase

SINE = "sine_0.5hz_0.20mpa"
HEADER = "t_s,dp_cmd_mpa,p1_mpa,p2_mpa,angle_deg\n"
ROWS = "0,0,0.2,0.2,0\n0.005,0.01,0.21,0.19,1.5\n0.010,0.02,0.22,0.18,3\n"


def test_a_record_is_the_sweep_with_time_from_its_first_tick(tmp_path: Path) -> None:
    content = made_log(tmp_path / "run.mcap", 1000, missed_at=500)
    (record,) = read(tmp_path / "run.mcap")
    sweep = content.samples.rows(content.samples["phase"] == Phase.SWEEP)
    assert len(record) == len(sweep) < 1000
    assert record.t_s[0] == 0.0
    assert np.allclose(np.diff(record.t_s).max(), 0.015)  # two missed periods stay a gap
    assert np.array_equal(record.angle_deg, sweep["angle_deg"])
    assert np.array_equal(record.extra["missed"], sweep["missed"])
    assert np.allclose(record.extra["lateness_us"], (sweep["woken_ns"] - sweep["scheduled_ns"]) / 1e3)
    assert (record.name, record.facts["session"], record.facts["repeat"]) == (SINE, "12e4", 1)
    assert record.facts["valid"] is False


def test_all_phases_on_request(tmp_path: Path) -> None:
    made_log(tmp_path / "run.mcap", 400)
    assert len(read(tmp_path / "run.mcap", phases=None)[0]) == 400
    (zero,) = read(tmp_path / "run.mcap", phases=(Phase.ZERO,))
    assert len(zero) == 20


def test_a_log_without_the_phase_says_which_it_has(tmp_path: Path) -> None:
    content = made_content(100)
    content.samples["phase"][:] = Phase.SETTLE
    write_content(content, tmp_path / "run.mcap")
    with pytest.raises(RecordError, match="holds no SWEEP, only SETTLE"):
        read(tmp_path / "run.mcap")


def test_sensors_that_the_rig_lacks_are_none(tmp_path: Path) -> None:
    content = made_content(200)
    for name in ("p1_mpa", "p2_mpa"):
        content.samples[name][:] = np.nan
    write_content(content, tmp_path / "run.mcap")
    (record,) = read(tmp_path / "run.mcap")
    assert record.p1_mpa is None
    assert record.angle_deg is not None
    assert not record.has_pressures


def test_sessions_and_repeats_of_a_folder(tmp_path: Path) -> None:
    for session in ("monday", "tuesday"):
        (tmp_path / session).mkdir()
        for name in (SINE, f"{SINE}_r2", "triangle_0.3hz_0.12mpa"):
            (tmp_path / session / f"{name}.csv").write_text(
                HEADER + ROWS + f"0.015,0.02,0.22,0.18,{ord(session[0]) + len(name)}\n"
            )
    records = read(tmp_path)
    keys = [(record.facts["session"], record.name, record.facts["repeat"]) for record in records]
    assert keys == [
        (s, n, r) for s in ("monday", "tuesday") for n, r in ((SINE, 1), (SINE, 2), ("triangle_0.3hz_0.12mpa", 1))
    ]
    assert (records[2].facts["signal"], records[2].facts["frequency_hz"], records[2].facts["amplitude_mpa"]) == (
        "triangle",
        0.3,
        0.12,
    )


def test_an_export_beside_its_log_is_no_second_record(tmp_path: Path) -> None:
    made_log(tmp_path / "run.mcap", 400)
    export(read_content(tmp_path / "run.mcap"), tmp_path / "run.csv", "csv")
    assert len(read(tmp_path)) == 1
    (tmp_path / "run.mcap").unlink()
    assert len(read(tmp_path)) == 1, "alone it is one"


def test_a_name_of_many_lines_is_one_line(tmp_path: Path) -> None:
    """Behind it `log compare` and `identify` said lines that were none of theirs."""
    content = made_content(100)
    facts = dict(content.run_facts) | {"name": "sine\nother.mcap: ok\u2028\x1b[2J\x85\u202ex_r2"}
    write_content(replace(content, run_facts=facts), tmp_path / "run.mcap")
    (record,) = read(tmp_path)
    assert record.name == "sine other.mcap: ok [2J x"


def test_a_folder_without_logs(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("nothing")
    with pytest.raises(RecordError, match="no log in this folder"):
        read(tmp_path)


def test_a_folder_inside_that_may_not_be_read_is_said_and_does_not_pass_for_empty(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`log check` called such a folder whole, and a diagnosis was one of half of the day."""
    made_log(tmp_path / "open" / "run.mcap")
    made_log(tmp_path / "closed" / "run.mcap")
    scandir = os.scandir

    def refusing(place: Any) -> Any:
        if Path(place).name == "closed":  # root may read everything
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(place))
        return scandir(place)

    monkeypatch.setattr(os, "scandir", refusing)
    with pytest.raises(RecordError, match=r"closed: cannot be read: Permission denied$"):
        read(tmp_path)
    with pytest.raises(RecordError, match=r"closed: cannot be read: Permission denied$"):
        found_or_unfinished((tmp_path,))


def test_several_runs_in_one_file(tmp_path: Path) -> None:
    content = made_content(400)
    content.samples["phase"][:] = Phase.SWEEP
    content.samples["run"][200:] = 2
    write_content(content, tmp_path / "run.mcap")
    records = read(tmp_path / "run.mcap")
    assert [(record.name, len(record), record.t_s[0]) for record in records] == [
        (f"{SINE}_run1", 200, 0),
        (f"{SINE}_run2", 200, 0),
    ]


def test_a_slice_of_time_opens_only_its_chunks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    content = made_log(tmp_path / "run.mcap", 3000)
    times = content.samples.log_time_ns
    with McapLog(tmp_path / "run.mcap") as log:
        fed: list[int] = []
        monkeypatch.setattr("rig.log.mcap.reader.SampleCollector.feed", spy(fed))
        part = log.samples(int(times[1500]), int(times[1649]))
        assert len(log.contents.chunks) == 30
    assert len(fed) == 1 + 2  # the first, which holds the schema, and the two that the span touches
    assert_same_samples(part, content.samples.rows(slice(1500, 1650)))


def test_a_stretch_by_the_index_touches_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    content = made_log(path, 3000)
    times = content.samples.log_time_ns
    wanted = content.samples.rows(slice(1500, 1650))
    assert_same_samples(read_stretch(path, int(times[1500]), int(times[1649])), wanted)
    data = bytearray(path.read_bytes())
    with McapLog(path) as log:
        starts = [chunk.start for chunk in log.contents.chunks]
    data[starts[3] + 500] ^= 1  # another chunk is damaged
    path.write_bytes(data)
    assert_same_samples(read_stretch(path, int(times[1500]), int(times[1649])), wanted)
    data[starts[15] + 500] ^= 1  # one of the stretch's own
    path.write_bytes(data)
    with pytest.raises(RecordError, match="a chunk"):
        read_stretch(path, int(times[1500]), int(times[1649]))


def test_a_stretch_of_a_file_whose_index_is_damaged_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    times = made_log(path, 500).samples.log_time_ns
    data = bytearray(path.read_bytes())
    data[-200] ^= 1
    path.write_bytes(data)
    with pytest.raises(RecordError, match="CRC over the summary"):
        read_stretch(path, int(times[0]), int(times[9]))


def spy(fed: list[int]) -> object:
    from rig.log.mcap.collector import SampleCollector

    real = SampleCollector.feed

    def feed(self: SampleCollector, data: bytes, place: int) -> None:
        fed.append(place)
        real(self, data, place)

    return feed


def test_memory_is_in_proportion_to_the_data(tmp_path: Path) -> None:
    made_log(tmp_path / "run.mcap", 40_000)
    tracemalloc.start()
    samples = read_samples(tmp_path / "run.mcap")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 2.5 * sum(column.nbytes for column in samples.fields.values())


def test_a_file_of_another_version_is_read_by_its_own_schema(tmp_path: Path) -> None:
    samples = made_samples(50)
    older = {name: wire for name, wire in WIRES.items() if name not in ("angle_zero_deg", "fault")} | {
        "humidity": WIRES["p1_mpa"]
    }
    rows = pack_columns({**samples.fields, "humidity": samples["p1_mpa"]}, older)
    write_foreign(tmp_path / "old.mcap", schema.descriptor_set("pamrig.Sample", older), [row.tobytes() for row in rows])
    found = read_samples(tmp_path / "old.mcap")
    assert np.array_equal(found["angle_deg"], samples["angle_deg"])
    assert np.isnan(found["angle_zero_deg"]).all()
    assert not found["fault"].any()


def test_samples_of_another_protobuf_writer_are_read_message_by_message(tmp_path: Path) -> None:
    """Others leave out fields that are zero, so that no two messages are of one length."""
    samples = made_samples(60)
    pool = descriptor_pool.DescriptorPool()
    for file in FileDescriptorSet.FromString(schema.sample_descriptor_set()).file:
        pool.AddSerializedFile(file.SerializeToString())
    kind = message_factory.GetMessageClass(pool.FindMessageTypeByName("pamrig.Sample"))
    messages = [
        kind(**{name: column[row].item() for name, column in samples.fields.items()}).SerializeToString()
        for row in range(60)
    ]
    assert len({len(message) for message in messages}) > 1
    write_foreign(tmp_path / "other.mcap", schema.sample_descriptor_set(), messages)
    assert_fields(read_samples(tmp_path / "other.mcap"), samples)


@pytest.mark.parametrize("chunked", [True, False])
def test_files_without_chunks_and_in_other_compressions(tmp_path: Path, chunked: bool) -> None:
    samples = made_samples(60)
    messages = [row.tobytes() for row in pack_columns(samples.fields, WIRES)]
    write_foreign(
        tmp_path / "f.mcap",
        schema.sample_descriptor_set(),
        messages,
        use_chunking=chunked,
        compression=CompressionType.LZ4,
    )
    assert_fields(read_samples(tmp_path / "f.mcap"), samples)


def assert_fields(found: Samples, wanted: Samples) -> None:
    for name in WIRES:
        assert np.array_equal(found[name], wanted[name], equal_nan=found[name].dtype.kind == "f"), name


def write_foreign(path: Path, descriptors: bytes, messages: list[bytes], **options: object) -> None:
    with path.open("wb") as file:
        writer = Writer(file, **options)  # type: ignore[arg-type]
        writer.start()
        kind = writer.register_schema("pamrig.Sample", "protobuf", descriptors)
        channel = writer.register_channel("/rig/sample", "protobuf", kind)
        for number, message in enumerate(messages):
            writer.add_message(channel, number, message, number, number)
        writer.finish()


def test_another_programs_file_says_its_channels(tmp_path: Path) -> None:
    with (tmp_path / "f.mcap").open("wb") as file:
        writer = Writer(file)
        writer.start()
        channel = writer.register_channel("/joint", "json", writer.register_schema("Joint", "jsonschema", b"{}"))
        writer.add_message(channel, 0, b"{}", 0)
        writer.finish()
    with pytest.raises(
        RecordError, match=r"no channel /rig/sample .* it has /joint \(json, Joint\); `pamrig log import` maps"
    ):
        read(tmp_path / "f.mcap")


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "the file is empty"),
        (MAGIC, "it was not finished"),
        (MAGIC + MAGIC, "it was not finished"),
        (
            MAGIC + b"\x06" + struct.pack("<Q", 1 << 60),
            r"byte 8: a record \(opcode 6\) of 1152921504606846976 bytes where 0 are left",
        ),
        (b"\x89PNG\r\n\x1a\n" + bytes(100), "neither MCAP, TDMS nor text"),
        (b"text, but not a table", "no column t_s"),
        ("t_s,dp".encode("utf-16-le"), "neither MCAP"),
    ],
)
def test_files_that_are_no_logs(tmp_path: Path, data: bytes, message: str) -> None:
    path = tmp_path / "run.mcap"
    path.write_bytes(data)
    with pytest.raises(RecordError, match=message) as caught:
        read(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "empty"),
        (HEADER, "a header and no rows"),
        ("t_s;dp_cmd_mpa\n0;0\n", "another separator"),
        ('t_s,dp_cmd_mpa\n"0,005","0,1"\n', "decimal comma"),
        ("t_s,dp_cmd_mpa\n0,000,0,1\n", "decimal commas"),
        ("t_s,angle_deg\n0,1\n", "no column dp_cmd_mpa, nor p1_cmd_mpa and p2_cmd_mpa"),
        ("time,dp_cmd_mpa\n0,1\n", "no column t_s"),
        ("t_s,t_s,dp_cmd_mpa\n0,0,1\n", "'t_s' stands twice"),
        (HEADER + "0,0,0.2,0.2\n", "row 2: 4 cells where the header names 5"),
        (HEADER + ROWS + "0.015,x,0.2,0.2,0\n", "row 5: dp_cmd_mpa: 'x' is not a number"),
        (HEADER + ROWS + "0.015,nan,0.2,0.2,0\n", "dp_cmd_mpa is nan at row 4"),
        (HEADER + ROWS + "inf,0,0.2,0.2,0\n", "t_s is inf at row 4"),
        (HEADER + ROWS + "0.010,0,0.2,0.2,0\n", "time does not rise: 0.01 s at row 4 of the data follows 0.01 s"),
        (HEADER + ROWS + "0.001,0,0.2,0.2,0\n", "time does not rise: 0.001 s at row 4"),
    ],
)
def test_tables_that_cannot_be_used(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "run.csv"
    path.write_text(text)
    with pytest.raises(RecordError, match=message):
        read(path)


def test_irregular_time_and_missing_values_stay(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text("\ufeff" + HEADER + "2.0,0,0.2,0.2,\n2.003,0.01,,0.19,1.5\r\n2.5,0.02,0.22,0.18,3\n\n")
    (record,) = read(path)
    assert record.t_s == pytest.approx([0, 0.003, 0.5])
    assert record.facts["t0_s"] == 2.0
    assert record.angle_deg is not None
    assert np.isnan(record.angle_deg[0])
    assert record.p1_mpa is not None
    assert np.isnan(record.p1_mpa[1])


def test_set_points_stand_for_the_difference(tmp_path: Path) -> None:
    (tmp_path / "run.csv").write_text("t_s,p1_cmd_mpa,p2_cmd_mpa,load_n\n0,0.25,0.15,7\n1,0.3,0.1,8\n")
    (record,) = read(tmp_path / "run.csv")
    assert record.dp_cmd_mpa == pytest.approx([0.1, 0.2])
    assert record.extra["load_n"].tolist() == [7, 8]


def test_gzipped_tables(tmp_path: Path) -> None:
    path = tmp_path / f"{SINE}.csv.gz"
    packed = gzip.compress((HEADER + ROWS).encode())
    path.write_bytes(packed)
    assert len(read(path)[0]) == 3
    path.write_bytes(packed[:-9])
    with pytest.raises(RecordError, match="cut or broken"):
        read(path)
    path.write_bytes(gzip.compress(b"0" * (80 << 20)))
    with pytest.raises(RecordError, match="unpacks to more than 16 MiB"):
        read(path)


def test_a_record_as_mcap_comes_back_with_every_value(tmp_path: Path) -> None:
    (tmp_path / f"{SINE}.csv").write_text(HEADER + ROWS)
    (record,) = read(tmp_path / f"{SINE}.csv")
    write_record(record, tmp_path / "made.mcap", {"simulated": True})
    (back,) = read(tmp_path / "made.mcap")
    assert back.name == record.name
    assert back.facts["simulated"] is True
    for name, column in record.columns().items():
        assert np.array_equal(back.columns()[name], column), name


def test_a_message_from_beyond_2262_is_refused(tmp_path: Path) -> None:
    content = made_content(10)
    late = replace(content.samples, log_time_ns=content.samples.log_time_ns.astype(np.uint64) + np.uint64(1 << 63))  # type: ignore[arg-type]
    write_content(replace(content, samples=late, lines=()), tmp_path / "run.mcap")
    with pytest.raises(RecordError, match="beyond the year 2262"):
        read(tmp_path / "run.mcap")


def test_a_pipe_is_refused_and_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(pipe := tmp_path / "pipe.csv")
    with pytest.raises(RecordError, match=r"pipe.csv: cannot be read: it is not a regular file"):
        read(pipe)


def test_a_folder_has_the_files_whose_suffix_is_in_capitals(tmp_path: Path) -> None:
    (tmp_path / f"{SINE}.CSV").write_text(HEADER + ROWS)
    (tmp_path / "lower.csv").write_text(HEADER + ROWS + "0.015,0.02,0.22,0.18,4\n")
    (tmp_path / "packed.Csv.GZ").write_bytes(gzip.compress((HEADER + ROWS + "0.015,0.02,0.22,0.18,5\n").encode()))
    made_log(tmp_path / "run.MCAP", 400)
    (tmp_path / "run.CSV").write_text("a table beside its recording counts once")
    assert [record.name for record in read(tmp_path)] == [SINE, "lower", "packed", SINE]
