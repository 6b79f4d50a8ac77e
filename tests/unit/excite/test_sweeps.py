"""Sweeps: what their YAML expands to, what the shipped ones hold, and what is refused before anything moves."""

import time
import tracemalloc
from array import array
from dataclasses import dataclass, replace
from pathlib import Path

import pytest
from conftest import CONFIGS

from rig.errors import ConfigError, EnvelopeError
from rig.excite.envelope import check
from rig.excite.run_plan import RunPlan, expand
from rig.excite.sweep import load_sweep

PERIOD_NS = 5_000_000
SWEEPS = CONFIGS / "sweeps"


@dataclass(frozen=True)
class Envelope:
    pressure_mpa: tuple[float, float] = (0.005, 0.5)
    slew_mpa_s: float = 2.0


def plans(folder: Path, text: str, period_ns: int = PERIOD_NS) -> list[RunPlan]:
    (folder / "sweep.yaml").write_text(text)
    return expand(load_sweep(folder / "sweep.yaml"), period_ns)


@pytest.mark.parametrize("file", sorted(SWEEPS.glob("*.yaml")), ids=lambda file: file.stem)
def test_every_shipped_sweep_fits_the_regulators_and_has_one_name_a_record(file: Path) -> None:
    runs = expand(load_sweep(file), PERIOD_NS)
    for run in runs:
        check(run, Envelope(), PERIOD_NS)
    assert len({run.name for run in runs}) == len(runs)


def test_the_paper_s_programme() -> None:
    runs = expand(load_sweep(SWEEPS / "paper.yaml"), PERIOD_NS)
    names = {run.name for run in runs}
    for frequency in (0.2, 0.5, 0.8):
        assert {f"sine_{frequency}hz_0.20mpa", f"triangle_{frequency}hz_0.20mpa"} <= names
    assert "mixed_0.5hz_0.10mpa" in names
    assert {len(run.dp_mpa) * PERIOD_NS for run in runs} == {10_000_000_000}
    assert {run.p0_mpa for run in runs} == {0.2}


def test_lists_repeats_and_p0_multiply(tmp_path: Path) -> None:
    runs = plans(
        tmp_path,
        "p0_mpa: [0.15, 0.2]\nrepeats: 2\nrecords: [{sine: {frequency_hz: [0.2, 0.5], amplitude_mpa: [0.1, 0.125]}}]",
    )
    assert len(runs) == 2 * 2 * 4
    assert [run.name for run in runs[:3]] == [f"sine_0.2hz_{a}mpa_p0_0.15mpa_r1" for a in ("0.10", "0.125")] + [
        "sine_0.5hz_0.10mpa_p0_0.15mpa_r1"
    ]
    assert runs[-1].facts == {
        "signal": "sine", "frequency_hz": 0.5, "amplitude_mpa": 0.125, "p0_mpa": 0.2, "repeat": 2, "sweep": "sweep",
    }  # fmt: skip


def test_a_record_may_have_its_own_times(tmp_path: Path) -> None:
    records = (
        "[{sine: {frequency_hz: 1, amplitude_mpa: 0.1}}, {hold: {amplitude_mpa: 0.1}, duration_s: 4, ramp_in_s: 0.1}]"
    )
    first, second = plans(tmp_path, f"duration_s: 2\nsettle_s: 1\nrecords: {records}")
    assert (first.settle_ticks, len(first.dp_mpa), first.ramp_in_ticks) == (200, 400, 100)
    assert (second.settle_ticks, len(second.dp_mpa), second.ramp_in_ticks) == (200, 800, 20)
    assert second.ticks == 200 + 100 + 20 + 800 + 200


def test_equal_names_are_told_apart(tmp_path: Path) -> None:
    text = "records: [{sine: {frequency_hz: 1, amplitude_mpa: 0.1}}, {sine: {frequency_hz: 1, amplitude_mpa: 0.1}}]"
    assert [run.name for run in plans(tmp_path, text)] == ["sine_1hz_0.10mpa", "sine_1hz_0.10mpa_2"]


def test_a_number_gives_no_name_that_another_record_has(tmp_path: Path) -> None:
    """Two of w.csv and one of w_2.csv were two files of one name: the run ended at the second."""
    for name in ("w", "w_2"):
        (tmp_path / f"{name}.csv").write_text("t_s,dp_mpa\n0,0\n1,0.1\n")
    files = ", ".join(f"{{waveform: {{file: {name}.csv}}}}" for name in ("w", "w", "w_2", "w"))
    names = [run.name for run in plans(tmp_path, f"records: [{files}]")]
    assert names == ["waveform_w", "waveform_w_3", "waveform_w_2", "waveform_w_4"]


def test_records_are_told_apart_by_more_than_capitals(tmp_path: Path) -> None:
    """On a disk that takes capitals for small letters the second one did not get its name."""
    for name in ("push_A", "push_a", "push_a_2"):
        (tmp_path / f"{name}.csv").write_text("t_s,dp_mpa\n0,0\n1,0\n")
    files = ", ".join(f"{{waveform: {{file: {name}.csv}}}}" for name in ("push_A", "push_a", "push_a_2"))
    names = [run.name for run in plans(tmp_path, f"records: [{files}]")]
    assert names == ["waveform_push_A", "waveform_push_a_3", "waveform_push_a_2"]


def test_a_record_s_name_is_one_that_a_disk_takes(tmp_path: Path) -> None:
    """A table with a long name ended `run` in a traceback, and a daemon as an error in the daemon itself."""
    for stem, fits in (("x" * 180, True), ("\u00e4" * 100, False), ("x" * 240, False)):
        (tmp_path / f"{stem}.csv").write_text("t_s,dp_mpa\n0,0\n1,0\n")
        (tmp_path / "s.yaml").write_text(f"records: [{{waveform: {{file: {stem}.csv}}}}]")
        sweep = load_sweep(tmp_path / "s.yaml")
        if fits:
            assert expand(sweep, PERIOD_NS)[0].name == f"waveform_{stem}"
            continue
        with pytest.raises(ConfigError, match="bytes; at most 200: give the file of its table a shorter name"):
            expand(sweep, PERIOD_NS)


def test_a_name_says_the_length_that_makes_the_waveform(tmp_path: Path) -> None:
    """Two sweeps with chirps of 10 and of 20 s had records of one name, which then had to pair and could not."""
    chirps = "{chirp: {amplitude_mpa: 0.1, length_s: [10, 20]}}"
    multisines = "{multisine: {amplitude_mpa: 0.1, period_s: [5, 10]}}"
    assert [plan.name for plan in plans(tmp_path, f"records: [{chirps}, {multisines}]")] == [
        "chirp_0.1-2hz_10s_0.10mpa",
        "chirp_0.1-2hz_20s_0.10mpa",
        "multisine_0.1-2hz_5s_0.10mpa_seed1",
        "multisine_0.1-2hz_10s_0.10mpa_seed1",
    ]


def test_tables_may_be_a_list_as_any_parameter(tmp_path: Path) -> None:
    for name in ("v", "w"):
        (tmp_path / f"{name}.csv").write_text("t_s,dp_mpa\n0,0\n1,0.1\n2,0\n")
    names = [plan.name for plan in plans(tmp_path, "records: [{waveform: {file: [v.csv, w.csv]}}]")]
    assert names == ["waveform_v", "waveform_w"]


def test_a_waveform_is_found_beside_its_sweep_and_lasts_as_long_as_its_table(tmp_path: Path) -> None:
    (tmp_path / "w.csv").write_text("t_s,dp_mpa\n0,0\n3,0.1\n")
    (run,) = plans(tmp_path, "duration_s: 7\nrecords: [{waveform: {file: w.csv}}]")
    assert len(run.dp_mpa) == 600


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("records: []", "records: expected a list of signals"),
        ("[]", "expected a mapping with the keys records"),
        ("p0_mpa: []\nrecords: [{hold: {amplitude_mpa: 0}}]", "p0_mpa: expected a value or a list of at least one"),
        ("records: [{hold: {amplitude_mpa: 0}, p0_mpa: []}]", r"records\[0\]: p0_mpa: expected a value or a list of"),
        ("records: [{hold: {amplitude_mpa: []}}]", r"records\[0\].hold: amplitude_mpa: expected a value or a list of"),
        ("records: [{sin: {frequency_hz: 1}}]", r"records\[0\]: expected one signal; did you mean 'sine'"),
        (
            "records: [{sine: {frequency_hz: 1, amplitude_mpa: 0.1}, hold: {amplitude_mpa: 0}}]",
            r"records\[0\]: expected one signal",
        ),
        (
            "records: [{sine: {frequency_hz: 1, amplitude_mp: 0.1}}]",
            r"records\[0\].sine: unknown key 'amplitude_mp'; did you mean 'amplitude_mpa'",
        ),
        (
            "records: [{sine: {frequency_hz: [1, 1000], amplitude_mpa: 0.1}}]",
            r"records\[0\].sine: frequency_hz: 1000 Hz is outside",
        ),
        ("records: [{sine: 5}]", r"records\[0\].sine: expected a mapping"),
        (
            "records: [{sine: {frequency_hz: 1, amplitude_mpa: 0.1}, durations: 5}]",
            r"records\[0\]: unknown key 'durations'; did you mean 'duration_s'",
        ),
        ("repeat: 2\nrecords: [{hold: {amplitude_mpa: 0}}]", "unknown key 'repeat'; did you mean 'repeats'"),
        ("p0_mpa: 2\nrecords: [{hold: {amplitude_mpa: 0}}]", "p0_mpa: 2 MPa is outside"),
        ("records: [{prbs: {amplitude_mpa: 0.1, order: 8}}]", r"records\[0\].prbs: order 8 is not there"),
        ("records: [{waveform: {file: /dev/zero}}]", "/dev/zero: cannot be read: it is not a regular file"),
        ("records: [{waveform: {file: none.csv}}]", "none.csv: cannot be read: No such file"),
        (
            "records: [{sine: {frequency_hz: 60, amplitude_mpa: 0.1}}]",
            "sine_60hz_0.10mpa holds 60 Hz; a period of 5 ms allows 50 Hz",
        ),
    ],
)
def test_what_is_no_sweep_is_refused_in_one_line(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(ConfigError, match=message) as caught:
        plans(tmp_path, text)
    assert "\n" not in str(caught.value)


def test_a_set_point_outside_the_range_is_refused_with_signal_time_and_value(tmp_path: Path) -> None:
    (run,) = plans(tmp_path, "p0_mpa: 0.3\nrecords: [{sine: {frequency_hz: 0.5, amplitude_mpa: 0.5}}]")
    message = r"sine_0.5hz_0.50mpa: set-point p1 would be 0.5\d+ MPa; allowed is 0.005 .. 0.5 MPa .sweep, at 0.\d+ s."
    with pytest.raises(EnvelopeError, match=message):
        check(run, Envelope(), PERIOD_NS)


def test_the_lower_set_point_is_checked_too(tmp_path: Path) -> None:
    (run,) = plans(tmp_path, "p0_mpa: 0.1\nrecords: [{sine: {frequency_hz: 0.5, amplitude_mpa: 0.2}}]")
    with pytest.raises(EnvelopeError, match=r"set-point p2 would be 0.00\d+ MPa"):
        check(run, Envelope(), PERIOD_NS)


def test_a_jump_is_refused_wherever_it_lies() -> None:
    calm = RunPlan("calm", 0.2, array("d", [0.1] * 10), 10, 0, 20, 20)
    check(calm, Envelope(), PERIOD_NS)
    for part, plan in {
        "ramp in": replace(calm, ramp_in_ticks=2),
        "sweep": replace(calm, dp_mpa=array("d", [0.1] * 9 + [-0.1])),
        "ramp out": replace(calm, ramp_out_ticks=2),
    }.items():
        with pytest.raises(EnvelopeError, match=rf"calm: set-point p1 would change by \d+ MPa/s; allowed is 2 .{part}"):
            check(plan, Envelope(), PERIOD_NS)


TOO_MUCH = {
    "lists that multiply": ("records: [{sine: {frequency_hz: [" + "1," * 2000 + "1], "
                            "amplitude_mpa: [" + "0.1," * 2000 + "0.1]}}]",
                            r"stand for 4004001 records \(lists, p0_mpa and repeats multiply\); at most 20000"),
    "repeats": ("repeats: 10000\np0_mpa: [0.2, 0.21, 0.22]\nrecords: [{hold: {amplitude_mpa: 0.1}}]",
    "stand for 30000 records"),
    "days of waveforms": ("duration_s: 86400\nrecords: [{sine: {frequency_hz: [0.1, 0.2], amplitude_mpa: 0.1}}]",
                          "its waveforms last 48.0 h together, 34560000 ticks; at most 20000000 ticks"),
    "lines without end": ("records: [{multisine: {amplitude_mpa: 0.1, high_hz: 2147483647}}]",
                          r"multisine: high_hz: 2.14748e\+09 Hz is outside 0.001 .. 100 Hz"),
    "lines and lines": ("records: [{multisine: {amplitude_mpa: 0.1, high_hz: 100, period_s: 1000}}]",
                        "high_hz times period_s is 100000, the number of its highest line; at most 2500"),
    "a long file": ("records: []" + " " * 300_000, "it has 300011 bytes, allowed are 262144"),
    "numbers without end": ("records: [{sine: {frequency_hz: 1" + "0" * 400 + ", amplitude_mpa: 0.1}}]",
                            "frequency_hz: a number of more than 20 digits Hz is outside"),
}  # fmt: skip


@pytest.mark.parametrize(("text", "message"), TOO_MUCH.values(), ids=TOO_MUCH.keys())
def test_what_stands_for_too_much_is_refused_before_it_is_built(tmp_path: Path, text: str, message: str) -> None:
    tracemalloc.start()
    began = time.process_time()
    with pytest.raises(ConfigError, match=message):
        plans(tmp_path, text)
    assert time.process_time() - began < 3.0
    assert tracemalloc.get_traced_memory()[1] < 30e6
    tracemalloc.stop()


@pytest.mark.parametrize("text", ["t_s,dp_mpa\n" + "1" * 200_000, "t_s,dp_mpa\n\0,1"])
def test_a_table_that_is_none_is_one_line(tmp_path: Path, text: str) -> None:
    (tmp_path / "w.csv").write_text(text)
    with pytest.raises(ConfigError, match=r"w.csv"):
        plans(tmp_path, "records: [{waveform: {file: w.csv}}]")


def test_a_record_may_have_rest_pressures_of_its_own(tmp_path: Path) -> None:
    text = """
p0_mpa: [0.15, 0.2]
records:
  - sine: {frequency_hz: 0.5, amplitude_mpa: 0.1}
  - hold: {amplitude_mpa: 0.1}
    p0_mpa: 0.3
"""
    runs = plans(tmp_path, text)
    assert [(run.facts["signal"], run.p0_mpa) for run in runs] == [("sine", 0.15), ("hold", 0.3), ("sine", 0.2)]
    assert len({run.name for run in runs}) == 3
    assert all("p0" in run.name for run in runs)


def test_records_are_counted_at_their_own_rest_pressures(tmp_path: Path) -> None:
    text = "repeats: 10000\nrecords: [{hold: {amplitude_mpa: 0.1}, p0_mpa: [0.1, 0.2, 0.3]}]"
    with pytest.raises(ConfigError, match="30000 records"):
        plans(tmp_path, text)
