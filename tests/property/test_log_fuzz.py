"""Whatever bytes a file holds, reading, checking and rescuing it ends soon, in bounded memory, with a result or one
clear line."""

import gzip
import itertools
import json
import struct
import time
import tracemalloc
import zlib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import hostile_logs
import pytest
import zstandard
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from support.records.made_logs import made_log
from support.records.mapped_files import read_mapped

from rig.errors import RigError
from rig.log.check import check
from rig.log.exchange import read_exported
from rig.log.foreign.mapping import load_mapping
from rig.log.mcap import schema
from rig.log.mcap.framing import MAGIC
from rig.log.mcap.reader import read_stretch
from rig.log.mcap.writer import RunWriter
from rig.log.reader import read
from rig.log.recover import recover

FEW = settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
BOUND_BYTES = 500 << 20

JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=8,
)


@cache
def sound() -> bytes:
    with TemporaryDirectory() as folder:
        made_log(Path(folder) / "run.mcap", 250)
        return (Path(folder) / "run.mcap").read_bytes()


def assert_survived(data: bytes, name: str = "x.mcap") -> None:
    """Every way to open the file ends with a result or with a RigError of one line."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / name
        path.write_bytes(data)
        foreign = Path(folder) / "mapping.yaml"
        columns = {"t_s": {"source": "log_time"}, "angle_deg": {"source": "angle_deg"}}
        foreign.write_text(json.dumps({"topic": "/rig/sample", "columns": columns}))
        mapping = load_mapping(foreign)
        ways: list[Callable[[Path], object]] = [read, check, recover, lambda file: read_mapped(file, mapping)]
        ways.append(lambda file: read_stretch(file, 0, 1 << 62))
        if name.endswith((".csv", ".mat", ".parquet")):
            ways = [read, read_exported, check]
        for way in ways:
            said = ""
            try:
                way(path)
            except RigError as error:
                said = str(error)
            assert "\n" not in said


edits = st.lists(st.tuples(st.floats(0, 1, exclude_max=True), st.integers(0, 255)), min_size=1, max_size=8)


@FEW
@given(edits)
def test_overwritten_bytes(changes: list[tuple[float, int]]) -> None:
    data = bytearray(sound())
    for share, value in changes:
        data[int(share * len(data))] = value
    assert_survived(bytes(data))


@FEW
@given(st.floats(0, 1), st.floats(0, 1), st.binary(max_size=40))
def test_pieces_cut_out_and_put_in(a: float, b: float, put: bytes) -> None:
    data = sound()
    first, last = sorted((int(a * len(data)), int(b * len(data))))
    assert_survived(data[:first] + put + data[last:])


@FEW
@given(
    st.lists(st.tuples(st.integers(0, 20), st.integers(0, 2**64 - 1) | st.none(), st.binary(max_size=60)), max_size=8),
    st.booleans(),
)
@example([(6, 2**63, b"")], True)
@example([(6, None, bytes(28) + b"\x04\0\0\0zstd" + bytes(8))], True)
@example([(6, None, bytes(28) + bytes(4) + bytes(8))], True)
@example([(0, None, b"")] * 8, False)
def test_records_of_any_kind_and_length(records: list[tuple[int, int | None, bytes]], end: bool) -> None:
    body = b"".join(
        struct.pack("<BQ", op, len(data) if length is None else length) + data for op, length, data in records
    )
    assert_survived(MAGIC + body + (MAGIC if end else b""))


@FEW
@given(st.binary(max_size=300))
def test_any_bytes(data: bytes) -> None:
    assert_survived(data)
    assert_survived(data, "x.csv")
    assert_survived(b"TDSm" + data, "x.tdms")
    assert_survived(data, "x.mat")


@FEW
@given(st.text(alphabet='0123456789.,;-einaft_s"\n\t# ', max_size=200))
def test_any_table(text: str) -> None:
    assert_survived(b"t_s,dp_cmd_mpa\n0,0\n" + text.encode(), "x.csv")
    assert_survived(text.encode(), "x.csv")
    assert_survived(gzip.compress(b"t_s,dp_cmd_mpa\n" + text.encode()), "x.csv")


@FEW
@given(st.dictionaries(st.text(), JSON))
def test_facts_of_any_kind_come_back(facts: dict[str, object]) -> None:
    facts.pop("crc32", None)
    texts = schema.facts_to_text(facts)
    assert all(isinstance(text, str) for text in texts.values())
    assert schema.facts_from_text(texts) == facts
    assert schema.facts_intact(texts)


@FEW
@given(st.text(), st.integers(0, 2**62))
def test_log_lines_of_any_text_come_back(text: str, time_ns: int) -> None:
    with TemporaryDirectory() as folder:
        run = RunWriter(Path(folder) / "x.mcap", {}, {})
        run.log("error", text, time_ns)
        run.finish({})
        from rig.log.convert import read_content

        assert read_content(Path(folder) / "x.mcap").lines == ((time_ns, "error", text),)


def chunk(data: bytes, compression: bytes, packed: bytes, claimed: int | None = None) -> bytes:
    size = len(data) if claimed is None else claimed
    head = struct.pack("<QQQI", 0, 0, size, zlib.crc32(data)) + struct.pack("<I", len(compression)) + compression
    body = head + struct.pack("<Q", len(packed)) + packed
    return struct.pack("<BQ", 6, len(body)) + body


ZEROS, MANY = bytes(12 << 20), struct.pack("<BQHIQQ", 5, 22, 1, 0, 0, 0) * 400_000
BOMBS: dict[str, Callable[[], bytes]] = {
    "claims 16 EiB": lambda: chunk(b"", b"zstd", zstandard.compress(ZEROS), (1 << 64) - 1),
    "claims 4 GiB in its frame": lambda: chunk(
        b"", b"zstd", b"\x28\xb5\x2f\xfd\xe0" + struct.pack("<Q", 1 << 32) + bytes(8), 100
    ),
    "zeros": lambda: chunk(ZEROS, b"zstd", zstandard.compress(ZEROS)) * 20,
    "empty messages, ten times": lambda: chunk(MANY, b"zstd", zstandard.compress(MANY)) * 10,
    "empty records": lambda: struct.pack("<BQ", 13, 0) * 20_000,
    "nothing but sixes": lambda: b"\x06" * 1_000_000,
    "many chunk heads": lambda: (b"\x06" + struct.pack("<Q", 100) + bytes(28) + b"\x04\0\0\0zstd") * 20_000,
}


@pytest.mark.parametrize("name", BOMBS)
def test_bombs_stay_small_and_end(name: str) -> None:
    data = MAGIC + BOMBS[name]()
    tracemalloc.start()
    begun = time.process_time()
    assert_survived(data)
    spent_s, peak = time.process_time() - begun, tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < BOUND_BYTES
    assert spent_s < 120, "a bound against endless loops, not a measure"


def test_a_table_that_unpacks_without_end(tmp_path: Path) -> None:
    (tmp_path / "x.csv.gz").write_bytes(gzip.compress(b"t_s,dp_cmd_mpa\n" + b"0,0\n" * (30 << 20), 1))
    with pytest.raises(RigError, match="unpacks to more than"):
        read(tmp_path / "x.csv.gz")


def stuck(broken: bytes) -> bytes:
    """A file whose only chunk ends with a broken message of a channel of no interest."""
    footer = struct.pack("<BQI", 15, 4, 0) + struct.pack("<BQQQI", 2, 20, 0, 0, 0)
    data = struct.pack("<BQ", 0x90, 0) + broken
    return MAGIC + chunk(data, b"", data) + footer + MAGIC


@pytest.mark.parametrize("length", [0, 5, 21, 200, 1 << 40])
def test_a_message_that_cannot_be_passed_over_is_damage_and_no_endless_loop(tmp_path: Path, length: int) -> None:
    (tmp_path / "x.mcap").write_bytes(stuck(struct.pack("<BQHIQQ", 5, length, 9, 0, 0, 0)))
    with pytest.raises(RigError, match="inside the chunk"):
        read(tmp_path / "x.mcap")
    assert any("inside the chunk" in line for line in check(tmp_path / "x.mcap"))


QUADRATIC = {
    "attachments that claim the rest": (b"\x09" + struct.pack("<Q", 500_000) + bytes(16) + b"\x05\0\0\0") * 60_000,
    "metadata that claim the rest": (b"\x0c" + struct.pack("<Q", 500_000) + b"\x0a\0\0\0pamrig.run") * 60_000,
    "ends of the data": b"".join(struct.pack("<BQI", 15, 4, 0) for _ in range(3)),
}


@pytest.mark.parametrize("name", list(QUADRATIC))
def test_heads_that_claim_what_others_claim_too_cost_no_square(tmp_path: Path, name: str) -> None:
    (tmp_path / "x.mcap").write_bytes(MAGIC + QUADRATIC[name])
    begun = time.process_time()
    assert check(tmp_path / "x.mcap")
    assert time.process_time() - begun < 20, "of the order of a minute without a bound"


def test_the_data_end_once(tmp_path: Path) -> None:
    body = MAGIC + struct.pack("<BQI", 15, 4, 0)
    (tmp_path / "x.mcap").write_bytes(body + struct.pack("<BQI", 15, 4, zlib.crc32(body)) + MAGIC)
    with pytest.raises(RigError, match="a second data end"):
        read(tmp_path / "x.mcap")


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_files_made_against_the_readers(tmp_path: Path, seed: int) -> None:
    for name, data in itertools.islice(hostile_logs.cases(seed, tmp_path), 12):
        (tmp_path / name).write_bytes(data)
        hostile_logs.assert_read_in_time(tmp_path / name)
