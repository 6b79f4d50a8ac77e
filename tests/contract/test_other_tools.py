"""Our logs in software that is not ours: mcap's readers, mcap-protobuf-support, pymcap-cli, pandas, scipy, Rerun."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import NonSeekingReader, make_reader
from mcap.stream_reader import StreamReader
from support.records.made_logs import made_log

from rig.log.convert import read_content
from rig.log.exchange import export
from rig.sample import WIRES

PYMCAP = shutil.which("pymcap-cli", path=str(Path(sys.executable).parent))


@pytest.fixture
def run(tmp_path: Path) -> Path:
    made_log(tmp_path / "run.mcap", 350, missed_at=200)
    return tmp_path / "run.mcap"


def test_mcaps_indexed_reader(run: Path) -> None:
    content = read_content(run)
    with run.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.message_count == 352
        assert {channel.topic: summary.schemas[channel.schema_id].name for channel in summary.channels.values()} == {
            "/rig/sample": "pamrig.Sample",
            "/log": "foxglove.Log",
        }
        times = [message.log_time for _, _, message in reader.iter_messages(topics=["/rig/sample"])]
        assert times == content.samples.log_time_ns.tolist()
        assert [item.name for item in reader.iter_metadata()] == ["pamrig.run", "pamrig.result"]
        assert {item.name: item.data for item in reader.iter_attachments()} == content.attachments
        middle = times[100]
        found = list(
            reader.iter_messages(topics=["/rig/sample"], starting_at=middle, ending_before=middle + 50_000_000)
        )
        assert len(found) == 10


def test_mcaps_sequential_readers_and_their_crcs(run: Path) -> None:
    with run.open("rb") as file:
        assert sum(1 for _ in NonSeekingReader(file, validate_crcs=True).iter_messages()) == 352
    with run.open("rb") as file:
        names = [type(record).__name__ for record in StreamReader(file, validate_crcs=True).records]
    assert names[-1] == "Footer"
    assert names.count("Message") == 352


def test_log_lines_are_foxglove_log(run: Path) -> None:
    with run.open("rb") as file:
        messages = [
            (schema, json.loads(message.data))
            for schema, _, message in make_reader(file).iter_messages(topics=["/log"])
        ]
    schema, first = messages[0]
    assert schema is not None
    assert set(first) == set(json.loads(schema.data)["properties"])
    assert (first["level"], first["message"]) == (2, "begun")


def test_mcap_protobuf_support_decodes_every_field(run: Path) -> None:
    decoder = pytest.importorskip("mcap_protobuf.decoder")
    samples = read_content(run).samples
    with run.open("rb") as file:
        reader = make_reader(file, decoder_factories=[decoder.DecoderFactory()])
        decoded = [item.decoded_message for item in reader.iter_decoded_messages(topics=["/rig/sample"])]
    for name in WIRES:
        assert np.array_equal([getattr(message, name) for message in decoded], samples[name], equal_nan=True), name


@pytest.mark.skipif(PYMCAP is None, reason="pymcap-cli is not installed")
@pytest.mark.parametrize("command", [("doctor",), ("info",), ("recover",)])
def test_pymcap_cli(run: Path, command: tuple[str, ...]) -> None:
    extra = ["-o", str(run.with_name("recovered.mcap"))] if command == ("recover",) else []
    done = subprocess.run(
        [str(PYMCAP), *command, str(run), *extra], capture_output=True, text=True, check=False, timeout=120
    )
    assert done.returncode == 0, done.stderr
    if command == ("doctor",):
        assert "passed MCAP doctor checks" in " ".join(done.stdout.split())
        assert " error " not in done.stdout
    if extra:
        assert len(read_content(run.with_name("recovered.mcap")).samples) == 350


def test_pandas_reads_the_exports(run: Path) -> None:
    pandas = pytest.importorskip("pandas")
    pytest.importorskip("pyarrow")
    content = read_content(run)
    for kind, load in (("csv", pandas.read_csv), ("csv.gz", pandas.read_csv), ("parquet", pandas.read_parquet)):
        path = run.with_name(f"run.{kind}")
        export(content, path, kind)
        table = load(path)
        assert len(table) == 350
        for name in WIRES:
            assert np.array_equal(table[name].to_numpy(), content.samples[name], equal_nan=True), (kind, name)
        assert table["t_s"].iloc[-1] == pytest.approx((350 + 2 - 1) * 0.005, abs=1e-12)


def test_matlabs_format(run: Path) -> None:
    from scipy.io import loadmat

    content = read_content(run)
    export(content, run.with_name("run.mat"), "mat")
    table = loadmat(run.with_name("run.mat"), squeeze_me=True)
    assert np.array_equal(table["scheduled_ns"], content.samples["scheduled_ns"])
    assert str(table["units"]["p1_mpa"]) == "MPa"
    assert json.loads(str(table["pamrig"]))["run"]["operator"] == "Đào"


def test_parquet_carries_units(run: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    export(read_content(run), run.with_name("run.parquet"), "parquet")
    schema = parquet.read_schema(run.with_name("run.parquet"))
    assert schema.field("angle_deg").metadata[b"unit"] == b"deg"


def test_rerun(run: Path, tmp_path: Path) -> None:
    rerun = shutil.which("rerun")
    if rerun is None:
        pytest.skip("Rerun is not installed")
    done = subprocess.run(
        [rerun, "mcap", "convert", str(run), "-o", str(tmp_path / "run.rrd")],
        capture_output=True,
        check=False,
        timeout=120,
    )
    assert done.returncode == 0
    assert (tmp_path / "run.rrd").stat().st_size > 10_000
