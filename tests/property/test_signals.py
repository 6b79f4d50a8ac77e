"""The waveforms: exact values of the paper's three, and what must hold of every other for any parameters."""

import cmath
import math
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rig.errors import ConfigError
from rig.excite.signals import Chirp, Mixed, Multisine, Sine, Triangle, amount, sampled
from rig.excite.steps import Hold, Prbs, Staircase
from rig.excite.table import Waveform

amplitudes = st.floats(0.001, 1.0)
frequencies = st.floats(0.01, 20.0)
times = st.floats(0.0, 1000.0)


def test_the_paper_s_sine_peaks_at_a_quarter_cycle() -> None:
    sine = Sine(frequency_hz=0.5, amplitude_mpa=0.2)
    assert [sine.value(t) for t in (0.0, 0.5, 1.0, 1.5)] == pytest.approx([0, 0.2, 0, -0.2], abs=1e-15)
    assert sine.label == "sine_0.5hz_0.20mpa"


def test_the_paper_s_triangle_is_straight_between_its_peaks() -> None:
    triangle = Triangle(frequency_hz=0.5, amplitude_mpa=0.2)
    assert [triangle.value(t) for t in (0, 0.25, 0.5, 0.75, 1, 1.25, 1.5, 2)] == pytest.approx(
        [0, 0.1, 0.2, 0.1, 0, -0.1, -0.2, 0]
    )


@given(times)
def test_the_mixed_sine_is_equation_12(t: float) -> None:
    def s(frequency: float) -> float:
        return math.sin(2 * math.pi * frequency * t)

    u = 0.1 * s(0.5) + 0.6 * 0.1 * s(0.3 * 0.5) + 0.7 * 0.1 * s(1.5 * 0.5) + 0.1 * 0.1 * s(4 * 0.5)
    assert Mixed(frequency_hz=0.5, amplitude_mpa=0.1).value(t) == pytest.approx(u, abs=1e-11)


@given(amplitudes, frequencies, times)
def test_tones_stay_inside_their_amplitude(amplitude: float, frequency: float, t: float) -> None:
    assert abs(Sine(frequency, amplitude).value(t)) <= amplitude
    assert abs(Triangle(frequency, amplitude).value(t)) <= amplitude
    assert abs(Mixed(frequency, amplitude).value(t)) <= 2.4 * amplitude
    assert abs(Chirp(amplitude, 0.1, frequency).value(t)) <= amplitude


@given(st.integers(0, 10_000), st.integers(1_000_000, 100_000_000))
def test_a_tick_s_value_needs_no_tick_before_it(tick: int, period_ns: int) -> None:
    sine = Sine(0.5, 0.2)
    assert sampled(sine, tick + 1, period_ns)[tick] == sine.value(tick * period_ns * 1e-9)


@given(amplitudes, st.integers(0, 1000), st.sampled_from([(0.1, 2.0), (0.3, 1.1), (0.1, 0.1)]))
@settings(max_examples=30, deadline=None)
def test_a_multisine_excites_exactly_the_odd_lines(amplitude: float, seed: int, band: tuple[float, float]) -> None:
    signal = Multisine(amplitude_mpa=amplitude, low_hz=band[0], high_hz=band[1], period_s=10.0, seed=seed)
    points = 64
    samples = [signal.value(10.0 * i / points) for i in range(points)]
    spectrum = [
        abs(sum(x * cmath.exp(-2j * math.pi * i * k / points) for i, x in enumerate(samples))) / points
        for k in range(points // 2)
    ]
    excited = [line for line, size in enumerate(spectrum) if size > 1e-6 * amplitude]
    assert excited == [
        line
        for line in range(1, points // 2)
        if line % 2 and band[0] * 10 <= line + 1e-9 and line - 1e-9 <= band[1] * 10
    ]
    assert max(spectrum) == pytest.approx(min(spectrum[line] for line in excited), rel=1e-6)


@given(st.integers(0, 1000), st.floats(0.0, 100.0))
@settings(deadline=None)
def test_a_multisine_repeats_and_never_exceeds_its_amplitude(seed: int, t: float) -> None:
    signal = Multisine(amplitude_mpa=0.2, high_hz=1.0, seed=seed)
    assert abs(signal.value(t)) <= 0.2
    assert signal.value(t + 10.0) == pytest.approx(signal.value(t), abs=1e-9)


def test_a_multisine_uses_the_amplitude_it_is_given() -> None:
    assert max(map(abs, sampled(Multisine(amplitude_mpa=0.2), 2000, 5_000_000))) > 0.2 * 0.97


def test_multisines_of_two_seeds_differ() -> None:
    assert Multisine(0.2, seed=1).value(1.0) != pytest.approx(Multisine(0.2, seed=2).value(1.0))


def test_a_multisine_without_a_line_is_refused() -> None:
    with pytest.raises(ValueError, match=r"no odd multiple of 1/10 s lies in 0.15 .. 0.25 Hz"):
        Multisine(0.2, low_hz=0.15, high_hz=0.25)


@given(st.floats(0.01, 5.0), st.floats(0.02, 5.0), st.floats(1.0, 50.0), st.floats(0.0, 200.0))
def test_a_chirp_s_frequency_is_inside_its_band(low: float, high: float, length_s: float, t: float) -> None:
    chirp = Chirp(amplitude_mpa=1.0, low_hz=low, high_hz=high, length_s=length_s)
    step = 1e-4
    rate = (chirp.cycles(t + step) - chirp.cycles(t)) / step
    assert min(low, high) - 1e-4 <= rate <= max(low, high) + 1e-4


@given(st.sampled_from([3, 4, 5, 6, 7, 9, 10, 11, 15]), st.integers(0, 2**32 - 1))
@settings(max_examples=30, deadline=None)
def test_a_prbs_is_of_maximum_length_and_balanced(order: int, seed: int) -> None:
    bits = Prbs(0.1, order=order, seed=seed).bits
    twice = bits * 2
    windows = {twice[i : i + order] for i in range(len(bits))}
    assert len(bits) == 2**order - 1 == len(windows)  # every state but zero comes by once
    assert sum(bits) == 2 ** (order - 1)


def test_a_prbs_of_another_seed_starts_elsewhere_in_the_same_sequence() -> None:
    one, two = (Prbs(0.1, order=5, seed=seed).bits for seed in (1, 2))
    assert one != two
    assert "".join(map(str, two)) in "".join(map(str, one * 2))


def test_an_order_without_taps_is_refused() -> None:
    with pytest.raises(ValueError, match="order 8 is not there; allowed: 3, 4"):
        Prbs(0.1, order=8)


@given(st.integers(0, 20_000), st.integers(1, 20))
def test_levels_change_on_the_tick_that_is_due_and_at_the_rate_of_their_rise(tick: int, dwell_ticks: int) -> None:
    dwell_s = dwell_ticks * 0.005
    stairs = Staircase(amplitude_mpa=0.2, steps=4, dwell_s=dwell_s, rise_s=0.0)
    level = 0.2 * (1 - abs((tick // dwell_ticks / 4 + 1) % 4 - 2))
    assert stairs.value(tick * 5_000_000 * 1e-9) == pytest.approx(level, abs=1e-12)


@given(st.floats(0.02, 0.2), st.integers(0, 4000))
def test_no_step_is_steeper_than_its_rise(rise_s: float, tick: int) -> None:
    for signal, step in (
        (Staircase(0.2, steps=4, dwell_s=0.5, rise_s=rise_s), 0.05),
        (Prbs(0.1, clock_s=0.25, rise_s=rise_s), 0.2),
    ):
        change = abs(signal.value((tick + 1) * 0.005) - signal.value(tick * 0.005))
        assert change <= step * 0.005 / rise_s + 1e-9


@given(st.floats(0.01, 2.0), st.floats(0.0, 4.0))
def test_a_level_is_reached_before_it_is_left_or_the_signal_is_refused(length_s: float, rise_s: float) -> None:
    """A longer rise made a jump of what was missing, at the end of each dwell."""
    for make, name in (
        (lambda: Staircase(0.2, steps=4, dwell_s=length_s, rise_s=rise_s), "dwell_s"),
        (lambda: Prbs(0.1, clock_s=length_s, rise_s=rise_s), "clock_s"),
    ):
        if rise_s > length_s:
            with pytest.raises(ValueError, match=f"rise_s .* is longer than {name}"):
                make()
            continue
        signal, edge_s = make(), 3 * round(length_s * 1e9) * 1e-9
        before, after = signal.value(max(edge_s - 2e-9, 0.0)), signal.value(edge_s)
        assert rise_s == 0.0 or abs(after - before) < 1e-6 + 0.2 * 4e-9 / rise_s


def test_a_byte_order_mark_is_no_part_of_a_name(tmp_path: Path) -> None:
    (tmp_path / "w.csv").write_text("t_s,dp_mpa\n0,0\n1,0.1\n", encoding="utf-8-sig")
    assert Waveform(tmp_path / "w.csv").length_s == 1.0


def test_a_hold_may_be_negative() -> None:
    assert Hold(-0.1).value(5.0) == -0.1
    assert Hold(-0.1).label == "hold_-0.10mpa"


@pytest.mark.parametrize(("value", "text"), [(0.2, "0.20"), (0.125, "0.125"), (0.0, "0.00"), (-0.1, "-0.10")])
def test_pressures_in_names(value: float, text: str) -> None:
    assert amount(value) == text


def test_a_waveform_is_straight_between_its_rows_and_holds_its_ends(tmp_path: Path) -> None:
    (tmp_path / "w.csv").write_text("t_s,dp_cmd_mpa\n1.0,0.0\n2.0,0.1\n4.0,-0.1\n")
    wave = Waveform(tmp_path / "w.csv", scale=2.0)
    assert [wave.value(t) for t in (0, 1.5, 2.0, 3.0, 9.0)] == pytest.approx([0.0, 0.1, 0.2, 0.0, -0.2])
    assert (wave.length_s, wave.label) == (4.0, "waveform_w_x2")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "needs the columns t_s and dp_mpa .or dp_cmd_mpa.; it has none"),
        ("t,dp\n0,0\n", "it has t, dp"),
        ("t_s,dp_mpa\n", "holds no rows"),
        ("t_s,dp_mpa\n0,0\n0,1\n", "line 3: time does not rise"),
        ("t_s,dp_mpa\n0,x\n", "line 2: '0', 'x' are not two numbers"),
        ("t_s,dp_mpa\n0\n", "line 2: '0', None are not two numbers"),
        ("t_s,dp_mpa\n0,nan\n", "line 2: 0, nan: both must be finite"),
        ("t_s,dp_mpa\n0,0,0,0\n1,0,0,15\n", "line 2: more cells than the header's 2 columns; decimal commas"),
        ("t_s,dp_mpa,dp_mpa\n0,0,0.1\n", "dp_mpa stands twice"),
    ],
)
def test_a_table_that_is_no_waveform_is_refused(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "w.csv").write_text(text)
    with pytest.raises(ConfigError, match=message):
        Waveform(tmp_path / "w.csv").value(0.0)
