"""Curves, the potentiometer under load, fits of points, and calibrations that do not fit the device."""

import datetime
import math

import pytest

from drivers.calibration import (
    Calibration,
    Potentiometer,
    Taken,
    complaint,
    curve,
    for_role,
    inverse,
    loaded_ratio,
    nominal,
    parse_all,
    wiper_position,
)
from drivers.fitting import Form, Measured, calibrate, fit_line, fit_pieces, fit_points, furthest_point
from drivers.signals import SignalRange, Span
from rig.errors import ConfigError
from rig.interfaces import DeviceContext, Role
from rig.realtime.clock import VirtualClock

TODAY = datetime.date(2026, 11, 21)


def context(**calibration: object) -> DeviceContext:
    return DeviceContext(VirtualClock(), frozenset(Role), calibration=calibration)


def test_two_knots_are_a_line_that_goes_on() -> None:
    line = curve([(1.0, 0.0), (5.0, 0.5)])
    assert [line(v) for v in (1.0, 3.0, 5.0, 0.0)] == pytest.approx([0.0, 0.25, 0.5, -0.125])


def test_pieces_meet_at_their_knots_and_go_on() -> None:
    pieces = curve([(0.0, 0.0), (1.0, 1.0), (2.0, 3.0)])
    assert [pieces(v) for v in (-1.0, 0.5, 1.0, 1.5, 3.0)] == pytest.approx([-1.0, 0.5, 1.0, 2.0, 5.0])


def test_falling_curves_have_an_inverse_too() -> None:
    knots = [(0.0, 10.0), (1.0, 4.0), (3.0, -2.0)]
    back, there = inverse(knots), curve(knots)
    assert [back(there(raw)) for raw in (-1.0, 0.3, 1.0, 2.2, 5.0)] == pytest.approx([-1.0, 0.3, 1.0, 2.2, 5.0])


@pytest.mark.parametrize(
    ("knots", "says"),
    [
        ([(0.0, 1.0)], "at least 2 knots"),
        ([(1.0, 0.0), (1.0, 1.0)], "must rise"),
        ([(0.0, 0.0), (1.0, 1.0), (2.0, 0.5)], "rise or fall throughout"),
        ([(0.0, 0.0), (1.0, math.nan)], "not finite"),
    ],
)
def test_knots_without_an_inverse_are_refused(knots: list[tuple[float, float]], says: str) -> None:
    with pytest.raises(ValueError, match=says):
        curve(knots)


def test_the_load_bends_the_reading_by_four_twentysevenths() -> None:
    """4/27 of R_pot / R_load of full scale (hardware facts): half a degree for 5 kOhm into 500 kOhm."""
    worst = max(x / 3000 - loaded_ratio(x / 3000, 0.01) for x in range(3001))
    assert worst == pytest.approx(4 / 27 * 0.01, rel=0.01)
    assert worst * 345.0 == pytest.approx(0.5, abs=0.02)


def test_the_load_correction_is_exact() -> None:
    for load in (0.0, 0.01, 0.1, 1.0):
        for x in range(101):
            assert wiper_position(loaded_ratio(x / 100, load), load) == pytest.approx(x / 100, abs=1e-12)


def test_the_potentiometer_knows_its_dead_zone_and_an_open_wire() -> None:
    pot = Potentiometer()
    angle = pot.to_angle()
    assert angle(loaded_ratio(0.5, 0.01)) == pytest.approx(0.0, abs=1e-9)
    assert angle(loaded_ratio(0.75, 0.01)) == pytest.approx(345.0 / 4)
    for ratio in (0.0, 0.001, 0.999, 1.2, math.nan):
        assert pot.is_dead(ratio)
        assert math.isnan(angle(ratio))


def test_nominal_values_know_the_live_zero() -> None:
    monitor = nominal(Span(SignalRange.V_1_5))
    assert curve(monitor.knots)(3.0) == pytest.approx(0.25)
    assert monitor.is_broken(0.0)
    assert monitor.is_broken(math.nan)
    assert not monitor.is_broken(0.76)  # 6 % of the span below the live zero: off, not broken
    assert monitor.is_suspect(5.6)
    assert not nominal(Span(SignalRange.V_0_5)).is_broken(0.0)


def test_a_line_is_least_squares_with_its_uncertainty() -> None:
    fit = fit_line([(0.0, 0.0), (1.0, 1.2), (2.0, 1.8), (3.0, 3.0)], 0.05)
    line = curve(fit.knots)
    assert [line(0.0), line(3.0)] == pytest.approx([0.06, 2.94])
    assert fit.residual == pytest.approx(math.sqrt(0.072 / 4))
    assert fit.uncertainty == pytest.approx(math.sqrt(0.072 / 2 * (1 + 1 / 4 + 1.5**2 / 5) + 0.05**2))


def test_two_points_leave_nothing_to_judge_by() -> None:
    fit = fit_line([(0.0, 0.0), (1.0, 1.0)], 0.0)
    assert (fit.residual, fit.uncertainty) == (None, None)


def test_pieces_take_their_scatter_from_repeats() -> None:
    fit = fit_pieces([(0.0, 0.0), (0.0, 0.2), (1.0, 1.0), (1.0, 1.0)], 0.0)
    assert fit.knots == [(0.0, 0.1), (1.0, 1.0)]
    assert fit.uncertainty == pytest.approx(math.sqrt(0.02 / 2))


def test_pieces_without_repeats_take_it_from_their_bends() -> None:
    assert fit_pieces([(0.0, 0.0), (1.0, 1.5), (2.0, 2.0)], 0.0).uncertainty == pytest.approx(0.5)
    assert fit_pieces([(0.0, 0.0), (1.0, 1.0)], 0.0).uncertainty is None


def test_the_point_to_look_at_again_is_named() -> None:
    points = [(0.0, 0.0), (1.0, 1.0), (2.0, 2.7), (3.0, 3.0)]
    found = furthest_point(calibrate(Role.MONITOR_1, Measured(points), "2026-11-21", "points.yaml"))
    assert found is not None
    assert found == (3, pytest.approx(0.49))
    assert furthest_point(nominal(Span(SignalRange.V_1_5))) is None


@pytest.mark.parametrize(
    ("role", "points", "says"),
    [
        (Role.MONITOR_1, [[1.0, 0.1]], "too few"),
        (Role.MONITOR_1, [[1.0, 0.1], [1.0, 0.2]], "nothing moved"),
        (Role.VALVE_1, [[0.1, 0.1], [0.2, math.nan]], "point 2"),
        (Role.ANGLE, [[0.2, -90.0], [2.5, 0.0]], "ratio of 2.5"),
        (Role.VALVE_2, [[0.1, 0.2], [0.2, 0.2]], "rise or fall"),
    ],
)
def test_points_that_cannot_be_right_are_named(role: Role, points: list[list[float]], says: str) -> None:
    measured = Measured([(a, b) for a, b in points])
    with pytest.raises(ConfigError, match=says) as caught:
        calibrate(role, measured, "2026-11-21", "points.yaml")
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith(f"points.yaml: {role.value}:")


def test_pieces_that_turn_back_are_refused() -> None:
    with pytest.raises(ValueError, match="rise or fall"):
        fit_points([(0.0, 0.0), (1.0, 1.0), (2.0, 0.5)], Form.PIECES)


def test_the_potentiometer_is_calibrated_behind_its_load() -> None:
    points = [(loaded_ratio(x, 0.02), 300.0 * x - 150.0) for x in (0.1, 0.3, 0.5, 0.7, 0.9)]
    pot = calibrate(Role.ANGLE, Measured(points, pot_ohm=10_000.0), "2026-11-21", "points.yaml")
    assert isinstance(pot, Potentiometer)
    assert pot.taken.residual == pytest.approx(0.0, abs=1e-9)
    assert pot.to_angle()(loaded_ratio(0.6, 0.02)) == pytest.approx(30.0)


def test_a_regulator_is_calibrated_from_command_to_pressure_whatever_its_device() -> None:
    """At a command of 0.4 MPa the gauge showed 0.38: for 0.38 MPa the device must send what 0.4 MPa nominally is."""
    stored = Calibration([(0.0, 0.0), (0.4, 0.38)], raw_unit="MPa")
    for signal, volts in ((SignalRange.V_0_5, 4.0), (SignalRange.V_0_10, 8.0)):
        found = for_role(context(valve_1=stored), Role.VALVE_1, nominal(Span(signal)))
        assert inverse(found.knots)(0.38) == pytest.approx(volts)


@pytest.mark.parametrize(
    ("points", "says"),
    [
        ([(0.1, 0.1), (0.2, 0.101), (0.3, 0.102), (0.4, 0.103)], "a command of .* gave .* is the supply on"),
        ([(0.05, 0.45), (0.25, 0.25), (0.45, 0.05)], "gauges in the order of the commands"),
        ([(0.2, 0.2), (0.24, 0.22)], r"from 0.2 to 0.24 MPa the pressure changes by 0.50 of the command; allowed: 0.8"),
        ([(0.2, 0.2), (0.21, 0.215)], "changes by 1.50 of the command"),
    ],
)
def test_what_no_working_regulator_does_is_no_calibration(points: list[tuple[float, float]], says: str) -> None:
    """By the inverse of a supply that was too low a safe set-point of 0.2 MPa became full scale."""
    for form in Form:
        with pytest.raises(ConfigError, match=f"points.yaml: valve_1: .*{says}"):
            calibrate(Role.VALVE_1, Measured(points, form), "2026-11-21", "points.yaml")
    stored = {"knots": [list(point) for point in points], "raw_unit": "MPa"}
    with pytest.raises(ConfigError, match=says):
        for_role(context(valve_1=stored), Role.VALVE_1, nominal(Span(SignalRange.V_0_5)))


@pytest.mark.parametrize(
    ("knots", "says"),
    [
        (
            [(1.0, 0.0), (5.0, 0.3)],
            r"a reading of 5 V, nominally 0.5 MPa, is calibrated as 0.3 MPa",
        ),
        ([(1.0, 0.5), (5.0, 0.0)], "and the gauges in the order of the readings"),
        ([(1.0, 0.2), (5.0, 0.2001)], "are signal, low_mpa and high_mpa of the rig's YAML those of what is wired"),
        ([(2.6, 0.2), (3.0, 0.22)], r"from 2.6 to 3 V the pressure changes by 0.40 of what is nominal; allowed: 0.8"),
        ([(2.6, 0.2), (2.7, 0.22)], "changes by 1.60 of what is nominal"),
    ],
)
def test_what_no_monitor_of_that_span_does_is_no_calibration(knots: list[tuple[float, float]], says: str) -> None:
    """By points of another range the guard took 0.5 MPa in a muscle for 0.3 MPa."""
    with pytest.raises(ConfigError, match=f"calibration: monitor_1: .*{says}"):
        for_role(
            context(monitor_1={"knots": [list(knot) for knot in knots]}),
            Role.MONITOR_1,
            nominal(Span(SignalRange.V_1_5)),
        )


@pytest.mark.parametrize(("span_mpa", "off_mpa"), [(0.5, 0.049), (1.0, 0.099)])
def test_a_monitor_may_be_off_by_a_tenth_of_its_span(span_mpa: float, off_mpa: float) -> None:
    stored = {"knots": [[1.0, off_mpa], [5.0, span_mpa + off_mpa]], "raw_unit": "V"}
    found = for_role(context(monitor_1=stored), Role.MONITOR_1, nominal(Span(SignalRange.V_1_5, high_mpa=span_mpa)))
    assert curve(found.knots)(1.0) == off_mpa
    stored = {"knots": [[1.0, off_mpa + 0.002], [5.0, span_mpa + off_mpa + 0.002]], "raw_unit": "V"}
    with pytest.raises(ConfigError, match="a monitor is at most"):
        for_role(context(monitor_1=stored), Role.MONITOR_1, nominal(Span(SignalRange.V_1_5, high_mpa=span_mpa)))


def test_a_serial_monitor_is_held_to_its_counts() -> None:
    scale = Calibration([(0.0, 0.0), (1023.0, 0.5)], raw_unit="counts")
    with pytest.raises(ConfigError, match=r"a reading of 1023 counts, nominally 0\.5 MPa, is calibrated as 0\.05 MPa"):
        for_role(context(monitor_2={"knots": [[0.0, 0.0], [1023.0, 0.05]]}), Role.MONITOR_2, scale)


def test_a_regulator_calibrated_in_its_signal_is_held_to_the_same() -> None:
    with pytest.raises(ConfigError, match=r"a command of 0\.5 MPa gave 0\.3 MPa"):
        for_role(context(valve_1={"knots": [[0.0, 0.0], [5.0, 0.3]]}), Role.VALVE_1, nominal(Span(SignalRange.V_0_5)))


def test_a_regulator_a_few_per_cent_off_is_calibrated() -> None:
    points = [(0.05, 0.062), (0.15, 0.158), (0.25, 0.251), (0.35, 0.341), (0.45, 0.433)]
    for form in Form:
        found = calibrate(Role.VALVE_1, Measured(points, form), "2026-11-21", "points.yaml")
        assert isinstance(found, Calibration)
        assert inverse(found.knots)(0.251) == pytest.approx(0.25, abs=0.003)


def test_a_calibrated_monitor_keeps_its_live_zero() -> None:
    stored = {"knots": [[1.05, 0.0], [5.1, 0.5]], "raw_unit": "V"}
    found = for_role(context(monitor_1=stored), Role.MONITOR_1, nominal(Span(SignalRange.V_1_5)))
    assert found.broken_below == 0.5
    assert curve(found.knots)(1.05) == 0.0


@pytest.mark.parametrize(
    ("signal", "broken_below", "least"),
    [(SignalRange.V_1_5, 0.2, "0.2 V"), (SignalRange.MA_4_20, 0.8, "0.8 mA"), (SignalRange.V_0_5, None, "")],
)
def test_a_calibration_cannot_switch_off_what_tells_a_broken_wire(
    signal: SignalRange, broken_below: float | None, least: str
) -> None:
    """Zero did, without a word. A signal that starts at zero has no such limit, whatever is given."""
    knots = [list(knot) for knot in Span(signal).knots()]

    def kept(limit: float) -> Calibration:
        calibration = context(monitor_1={"knots": knots, "broken_below": limit})
        return for_role(calibration, Role.MONITOR_1, nominal(Span(signal)))

    if broken_below is None:
        assert not kept(0.0).is_broken(0.0)
        return
    assert kept(broken_below).is_broken(0.0)
    for limit in (broken_below - 0.001, 0.0, -1.0):
        with pytest.raises(
            ConfigError, match=f"monitor_1: broken_below: {limit:g} .*at least {least}, or leave it out"
        ):
            kept(limit)


@pytest.mark.parametrize(
    ("key", "allowed", "refused"),
    [("dead_below", 0.002, 0.0), ("dead_above", 0.998, 1.0), ("min_excitation_v", 0.1, 0.0)],
)
def test_an_open_wire_of_the_potentiometer_is_no_angle_whatever_is_calibrated(
    key: str, allowed: float, refused: float
) -> None:
    """Without excitation and its limit, the angle was divided by zero."""
    found = for_role(context(angle={key: allowed}), Role.ANGLE, Potentiometer())
    assert found.is_dead(0.0)
    assert found.is_dead(1.0)
    with pytest.raises(ConfigError, match=f"calibration: angle: {key}: {refused:g} .*is outside"):
        for_role(context(angle={key: refused}), Role.ANGLE, Potentiometer())


@pytest.mark.parametrize(
    ("stored", "says"),
    [
        ({"knots": [[0.0, 0.0], [20.0, 0.5]], "raw_unit": "mA"}, "calibrated in 'mA'; allowed for this device: V"),
        ({"knots": [[0.0, math.nan], [5.0, 0.5]]}, "finite"),
        ({"knots": [[0.0, 0.0], [5.0, 0.5]], "knot": 1}, "unknown key 'knot'; did you mean 'knots'"),
        ({"knots": []}, "at least 2 knots"),
        (3, "mapping"),
    ],
)
def test_a_calibration_that_does_not_fit_is_one_line(stored: object, says: str) -> None:
    with pytest.raises(ConfigError, match=says) as caught:
        for_role(context(monitor_2=stored), Role.MONITOR_2, nominal(Span(SignalRange.V_1_5)))
    assert str(caught.value).startswith("calibration: monitor_2:")
    assert "\n" not in str(caught.value)


def test_an_unknown_role_in_a_calibration_file_is_named() -> None:
    with pytest.raises(ConfigError, match="unknown role 'valve_3'"):
        parse_all({"valve_3": {}}, "cal.yaml")


@pytest.mark.parametrize(
    ("date", "says"),
    [("", "never calibrated"), ("2025-01-01", "689 days ago"), ("2027-01-01", "future"), ("2026-11-01", None)],
)
def test_old_and_missing_calibrations_are_warned_about(date: str, says: str | None) -> None:
    line = complaint("valve_1", Taken(date), TODAY)
    assert (line is None) if says is None else (line is not None and says in line)


def test_signals_and_spans_have_ends() -> None:
    span = Span(SignalRange.MA_4_20, 0.005, 0.9)
    assert (span.clamp_signal(3.0), span.clamp_signal(30.0)) == (4.0, 20.0)
    assert (span.clamp_mpa(-1.0), span.clamp_mpa(1.0)) == (0.005, 0.9)
    with pytest.raises(ValueError, match="below"):
        Span(SignalRange.V_0_5, 0.5, 0.5)
