"""LabVIEW's TDMS: units, when it began, and what is ambiguous or cut refused."""

from pathlib import Path

import numpy as np
import pytest

from rig.app.records.logs import import_content
from rig.errors import RecordError
from rig.log.convert import write_content
from rig.log.reader import read, read_samples


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
