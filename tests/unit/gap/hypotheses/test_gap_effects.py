"""The library of effects: complete, neutral at its neutral values, the same however a record is cut."""

from dataclasses import replace

import numpy as np
import pytest
from conftest import ROOT
from support.plants.gap_rigs import model

from rig.gap.hypotheses.library import LIBRARY, alike
from rig.model.chain import lay_out
from rig.model.compiled.stages import compiled
from rig.model.effect_stages import EFFECT_STAGES
from rig.model.effect_stages.valve import ATMOSPHERE_MPA
from rig.model.parameters import AddedEffect
from rig.report.effects_page import effects_markdown

WORDS = [
    "delay",
    "clock_drift",
    "lost_samples",
    "valve_gain",
    "valve_offset",
    "valve_lag",
    "valve_slew",
    "fill_exhaust_asymmetry",
    "valve_dead_band",
    "pressure_ceiling",
    "supply_droop",
    "co_contraction",
    "muscle_mismatch",
    "leak",
    "creep",
    "thermal_drift",
    "coulomb_friction",
    "viscous_friction",
    "inertia",
    "gravity_load",
    "stiffness",
    "backlash",
    "end_stop",
    "sensor_gain",
    "sensor_offset",
    "sensor_drift",
    "sensor_nonlinearity",
    "sensor_lag",
    "quantisation",
    "mains_hum",
    "sensor_noise",
    "sensor_dropout",
]
N, DT = 300, 0.005
T = DT * np.arange(N)


def ran(key: str, numbers: dict[str, float], cuts: tuple[int, ...] = (N,)) -> list[list[float]]:
    """p1, p2 and y after the stage in plain Python, block by block."""
    known = EFFECT_STAGES[key]
    columns = [list(0.2 + 0.08 * np.sin(9 * T)), list(0.2 - 0.08 * np.sin(9 * T)), list(20 * np.sin(9 * T - 0.3))]
    state, params = [0.0] * max(known.state_size, 1), [numbers[name] for name in known.parameters]
    start = 0
    for end in cuts:
        block = [column[start:end] for column in columns]
        p1_mpa, p2_mpa, angle_deg = block
        known.stage(p1_mpa, p2_mpa, angle_deg, state, params, DT)
        for column, part in zip(columns, block, strict=True):
            column[start:end] = part
        start = end
    return columns


def sized(key: str) -> dict[str, float]:
    """Numbers that make the effect plain."""
    known = EFFECT_STAGES[key]
    number = next(number for number in known.numbers if number.name == known.size)
    strong = {
        "pressure_ceiling": 0.25,
        "low_supply": 0.3,
        "end_stop": 15.0,
        "valve_slew": 0.2,
        "set_point_ramp": 0.2,
        "fill_exhaust_asymmetry": 3.0,
        "supply_droop": 0.05,
        "clogged_line": 0.5,
        "emptied_receiver": 0.2,
        "clock_drift": -0.004,  # a fast one reads ahead, as far as its block goes
    }
    return (
        known.neutral()
        | {"tau0_s": 0.04, "viscous_time_s": 0.02}
        | {number.name: strong.get(key, number.neutral + 0.1 * (number.high - number.neutral))}
    )


def test_library_has_every_word() -> None:
    assert list(LIBRARY) == WORDS
    assert {stage.effect for stage in EFFECT_STAGES.values()} == set(WORDS)


@pytest.mark.parametrize("key", list(EFFECT_STAGES))
def test_neutral_changes_nothing(key: str) -> None:
    before = ran("sensor_gain", {"gain": 0.0})
    for was, now in zip(before, ran(key, EFFECT_STAGES[key].neutral()), strict=True):
        np.testing.assert_allclose(now, was, atol=1e-6)


@pytest.mark.parametrize("key", list(EFFECT_STAGES))
def test_effect_changes_something_and_blocks_do_not_matter(key: str) -> None:
    numbers = sized(key)
    whole, cut = ran(key, numbers), ran(key, numbers, (1, 2, 70, N))
    assert (
        max(np.max(np.abs(np.subtract(a, b))) for a, b in zip(whole, ran("sensor_gain", {"gain": 0.0}), strict=True))
        > 1e-4
    )
    for one, other in zip(whole, cut, strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-12)


def test_being_alike_is_mutual() -> None:
    for pressures in (False, True):
        for name in LIBRARY:
            assert all(name in alike(other, pressures) for other in alike(name, pressures))
            assert name not in alike(name, pressures)


def test_reference_page_is_the_library() -> None:
    page = ROOT / "docs" / "reference" / "effects.md"
    assert page.read_text(encoding="utf-8") == effects_markdown(), (
        "run: python -m rig.report.effects_page > docs/reference/effects.md"
    )


def test_an_effect_acts_on_the_models_own_regulators() -> None:
    slow = AddedEffect("valve_lag", {"tau_s": 0.05})
    lag = next(stage for stage in lay_out(replace(model(), effects=[slow])) if stage.name == "valve_lag")
    tau0 = dict(zip(EFFECT_STAGES["valve_lag"].parameters, lag.params, strict=True))["tau0_s"]
    assert tau0 == pytest.approx(0.5 * (model().valve.value("valve1_tau_s") + model().valve.value("valve2_tau_s")))


def test_the_numbers_that_the_page_calls_the_rigs_own_are_those_that_the_rig_fills_in() -> None:
    for key, stage in EFFECT_STAGES.items():
        size = next(number for number in stage.numbers if number.name == stage.size)
        given = model(), replace(model(), p0_mpa=model().p0_mpa + 0.05)
        placed = [lay_out(replace(one, effects=[AddedEffect(key, {stage.size: size.neutral})])) for one in given]
        for_both = [
            dict(zip(stage.parameters, next(s for s in all_ if s.name == key).params, strict=True)) for all_ in placed
        ]
        filled = {n.name for n in stage.numbers if any(one[n.name] != n.neutral for one in for_both)}
        assert filled == {number.name for number in stage.numbers if number.own}, key


def test_a_tank_refills() -> None:
    numbers = EFFECT_STAGES["supply_droop"].neutral() | {"tau0_s": 0.04, "droop_s": 1.0, "refill_s": 0.2}
    sagging = np.array(ran("supply_droop", numbers)[0])
    healthy = np.array(ran("supply_droop", EFFECT_STAGES["supply_droop"].neutral())[0])
    behind = healthy - sagging
    assert behind.max() > 1e-3
    assert behind.max() > 5 * -behind.min(), "filling falls behind, exhausting does not"


def test_a_spring_beside_a_free_joint_makes_every_angle_smaller_alike() -> None:
    known = EFFECT_STAGES["stiffness"].neutral() | {"stiffness": 0.25}
    angle = 20 * np.sin(9 * T - 0.3)
    assert ran("stiffness", known | {"spring": 1.0})[2][1:] == pytest.approx(list(angle[1:] / 1.25), abs=1e-6)
    assert ran("stiffness", known)[2] == pytest.approx(list(angle), abs=1e-6)


def test_a_spring_counts_less_where_the_muscles_are_stiffer() -> None:
    known = EFFECT_STAGES["stiffness"].neutral() | {"stiffness": 0.25, "spring": 1.0, "p0_mpa": 0.1}
    angle, mean_mpa = 20 * np.sin(9 * T - 0.3), 0.2
    held = 1.0 + 0.25 * known["p0_mpa"] / mean_mpa
    assert ran("stiffness", known)[2][1:] == pytest.approx(list(angle[1:] / held), abs=1e-6)


def test_a_stiffness_that_rises_lets_friction_count_less_and_less() -> None:
    known = EFFECT_STAGES["stiffness"].neutral() | {"loop_2": 2.0}
    changed = np.abs(np.array(ran("stiffness", known | {"rise_per_min": 8.0})[2]) - 20 * np.sin(9 * T - 0.3))
    assert 0.0 < changed[:100].max() < changed[-100:].max()


@pytest.mark.parametrize("key", ["leak", "leak_ahead"])
def test_a_choked_leak_takes_its_share_of_the_absolute_pressure(key: str) -> None:
    p1 = 0.2 + 0.08 * np.sin(9 * T)
    for absolute in (0.0, 1.0):
        found = ran(key, {"loss": 0.1, "muscle": 1.0, "absolute": absolute})[0]
        assert found == pytest.approx(list(p1 - 0.1 * (p1 + absolute * ATMOSPHERE_MPA)))


def steps(key: str, numbers: dict[str, float], first: list[float]) -> list[float]:
    """Pressure of valve 1 after a stage in plain Python."""
    known = EFFECT_STAGES[key]
    p1_mpa, p2_mpa, angle_deg = list(first), list(first), [0.0] * len(first)
    numbers = known.neutral() | {"tau0_s": 0.05} | numbers
    known.stage(p1_mpa, p2_mpa, angle_deg, [0.0] * known.state_size, [numbers[name] for name in known.parameters], DT)
    return p1_mpa


def test_a_leak_that_a_regulator_feeds_takes_most_near_the_supply_s_pressure() -> None:
    leak = {"loss": 0.05, "supply_mpa": 0.38, "fill_mpa_s": 0.5}
    short = [p - steps("fed_leak", leak, [p] * 50)[-1] for p in (0.05, 0.15, 0.25, 0.3, 0.35)]
    assert short == sorted(short)
    assert short[0] == pytest.approx(0.05 * (0.05 + ATMOSPHERE_MPA) / 1.05, rel=0.02), "far below it fills at will"
    assert short[-1] > 1.5 * 0.05 * (0.35 + ATMOSPHERE_MPA) / 1.05
    assert steps("fed_leak", leak | {"muscle": 2.0}, [0.3] * 50) == [0.3] * 50, "the other muscle's"


def test_a_line_that_leaks_empties_faster_and_fills_more_slowly() -> None:
    leak = {"loss": 0.1, "supply_mpa": 0.5, "fill_mpa_s": 2.0}
    ends = {p: steps("fed_leak", leak, [p] * 50)[-1] for p in (0.1, 0.3)}

    def left(start: float, end: float) -> float:
        """Share of the way that is left after 40 ms."""
        now = steps("fed_leak", leak, rising(start, end))[round(0.04 / DT)]
        return (ends[end] - now) / (ends[end] - ends[start])

    assert left(0.3, 0.1) < np.exp(-0.04 / 0.05) < left(0.1, 0.3)


def rising(start: float, end: float) -> list[float]:
    """What a regulator of 50 ms makes of a step of its set-point, MPa."""
    return [end + (start - end) * np.exp(-DT * k / 0.05) for k in range(200)]


def test_a_resistance_in_series_takes_half_of_the_flow_at_the_limit() -> None:
    fast = rising(0.1, 0.3)
    limit = (fast[1] - fast[0]) / DT
    slowed = steps("valve_slew", {"fill_mpa_s": limit, "soft": 1.0}, fast)
    assert slowed[1] - slowed[0] == pytest.approx(0.5 * (fast[1] - fast[0]), rel=0.03)
    other_way = rising(0.3, 0.1)
    np.testing.assert_allclose(steps("valve_slew", {"fill_mpa_s": limit, "soft": 1.0}, other_way), other_way)


@pytest.mark.parametrize("supply_mpa", [0.25, 0.35, 0.5])
def test_a_muscle_fills_the_more_slowly_the_less_the_supply_lies_above_it(supply_mpa: float) -> None:
    asked = rising(0.1, 0.3)
    filled = steps("low_supply", {"supply_mpa": supply_mpa}, asked)
    assert max(filled) <= supply_mpa + 1e-9
    assert all(one <= other + 1e-12 for one, other in zip(filled, asked, strict=True))
    emptied = rising(0.2, 0.05)
    np.testing.assert_allclose(steps("low_supply", {"supply_mpa": supply_mpa}, emptied), emptied)


def test_a_tank_that_sags_to_the_muscles_pressure_fills_no_more() -> None:
    asked = rising(0.1, 0.45)
    filled = steps("supply_droop", {"droop_s": 2.0, "refill_s": 5.0}, asked)
    assert filled[30] < asked[30] - 0.05
    assert max(filled) < 0.45


def test_a_line_that_both_fill_through_takes_half_of_the_flow_at_the_limit_of_both() -> None:
    fast = rising(0.1, 0.3)
    one = (fast[1] - fast[0]) / DT
    slowed = steps("clogged_line", {"fill_mpa_s": one}, fast)  # both muscles are filled, the second from its first step
    assert slowed[1] - slowed[0] == pytest.approx(0.5 * (fast[1] - fast[0]), rel=0.03)
    alone = steps("valve_slew", {"fill_mpa_s": one, "soft": 1.0}, fast)
    assert slowed[20] < alone[20] - 1e-3, "the other muscle's filling counts"
    emptied = rising(0.3, 0.1)
    np.testing.assert_allclose(steps("clogged_line", {"fill_mpa_s": one}, emptied), emptied)


def test_a_receiver_empties_where_more_is_taken_than_its_supply_delivers_and_fills_up_again() -> None:
    wave = [0.2 + 0.06 * np.sin(2 * np.pi * 0.5 * DT * k) for k in range(4000)]
    rest = [wave[-1]] * 2000
    taken = 2 * 2 * 0.12 * 0.5 / 2  # both muscles, MPa/s: the stroke at each of 0.5 periods a second
    enough = steps("emptied_receiver", {"capacity_mpa_s": 4.0 * taken, "fall": 3.0}, wave)
    np.testing.assert_allclose(enough, wave, atol=2e-4)
    short = np.array(steps("emptied_receiver", {"capacity_mpa_s": 0.5 * taken, "fall": 3.0}, wave + rest))
    behind = np.array(wave) - short[:4000]
    assert np.max(np.abs(behind[:200])) < 0.2 * np.max(behind[-800:]), "it takes a while to empty"
    assert np.max(behind[-800:]) > 0.005
    assert short[-1] == pytest.approx(wave[-1], abs=1e-4)


def beyond(value: float, width: float) -> float:
    """What of a value lies outside of a dead zone."""
    return value - min(max(value, -width), width)


def through_pi(integral_s: float, unseen: float = 0.0, overlap: float = 0.0, tau_s: float = 0.05) -> list[float]:
    """What a PI regulator makes of two sines, before a volume that integrates: it sees no error below `unseen`, and its
    valve does not open below a drive of `overlap`."""
    time = DT * np.arange(3000)
    asked = 0.2 + 0.06 * np.sin(2 * np.pi * 0.3 * time) + 0.02 * np.sin(2 * np.pi * 0.71 * time)
    pressure, held, out = float(asked[0]), 0.0, []
    for one in asked:
        error = beyond(one - pressure, unseen)
        pressure += (1.0 - np.exp(-DT / tau_s)) * beyond(error + held, overlap)
        held += DT / integral_s * error
        out.append(float(pressure))
    return out


@pytest.mark.parametrize(
    ("key", "size", "zone", "plain", "missing"),
    [
        ("numb_regulator", "width_mpa", "unseen", 0.003, 0.1),
        ("overlapped_valve", "overlap_mpa", "overlap", 0.002, 0.02),
    ],
)
@pytest.mark.parametrize("integral_s", [0.15, 0.6, 2.0])
def test_a_dead_zone_of_a_regulator_that_integrates_is_that_of_a_pi_controller(
    key: str, size: str, zone: str, plain: float, missing: float, integral_s: float
) -> None:
    """In its error, or behind it at its valve."""
    nominal, known = (np.array(through_pi(integral_s, **{zone: width})) for width in (0.0, 0.006))
    made = steps(key, {size: 0.006, "integral_s": integral_s, "tau0_s": 0.05}, nominal.tolist())
    off, missed = known - nominal, np.array(made) - known
    assert np.std(off[600:]) > plain
    assert np.std(missed[600:]) < missing * np.std(off[600:])


@pytest.mark.parametrize("turbulent_mpa_s", [1000.0, 0.3])
@pytest.mark.parametrize("fill_share", [0.0, 1.0])
def test_behind_a_throttle_a_ramp_is_late_in_one_direction_alone(fill_share: float, turbulent_mpa_s: float) -> None:
    """In a ramp of q (MPa/s) the muscle stays tau q (1 + q / turbulent) short of the monitor."""
    for slope in (0.2, -0.2):
        asked = [0.3 + slope * DT * k for k in range(200)]
        numbers = {"tau_s": 0.05, "fill_share": fill_share, "turbulent_mpa_s": turbulent_mpa_s}
        short = abs(asked[-1] - steps("one_way_line", numbers, asked)[-1])
        slow = (slope > 0.0) is (fill_share > 0.5)
        assert short == pytest.approx(0.05 * 0.2 * (1.0 + 0.2 / turbulent_mpa_s) if slow else 0.0, rel=0.06, abs=1e-12)


@pytest.mark.parametrize("one_way", [-1.0, -0.4, 0.0, 0.7])
def test_a_dead_band_is_as_much_wider_to_fill_than_to_exhaust_as_is_said(one_way: float) -> None:
    rising_mpa, falling_mpa = ([0.2 + slope * DT * k for k in range(400)] for slope in (0.05, -0.05))
    for asked, width in ((rising_mpa, 0.01 * (1.0 + one_way)), (falling_mpa, 0.01 * (1.0 - one_way))):
        late = steps("valve_dead_band", {"width_mpa": 0.01, "one_way": one_way, "tau0_s": 0.05}, asked)
        assert abs(asked[-1] - late[-1]) == pytest.approx(width, abs=1e-4)


@pytest.mark.parametrize(
    ("key", "numbers"),
    [
        ("pressure_ceiling", {"ceiling_mpa": 0.25}),
        ("low_supply", {"supply_mpa": 0.25}),
        ("valve_slew", {"fill_mpa_s": 0.2, "exhaust_mpa_s": 0.2}),
        ("supply_droop", {"droop_s": 0.5, "supply_mpa": 0.26}),
        ("clogged_line", {"fill_mpa_s": 0.1}),
        ("emptied_receiver", {"capacity_mpa_s": 0.05, "fall": 5.0}),
    ],
)
def test_a_regulator_that_integrates_goes_on_after_the_limit_and_comes_back(
    key: str, numbers: dict[str, float]
) -> None:
    asked = [*rising(0.1, 0.3), *rising(0.3, 0.15), *([0.15] * 2000)]
    plain, winding = (np.array(steps(key, numbers | {"integral_s": s}, asked)) for s in (0.0, 0.5))
    assert np.max(winding[200:400] - plain[200:400]) > 2e-3, "late on the way down"
    assert winding[-1] == pytest.approx(asked[-1], abs=1e-3)
    assert plain[-1] == pytest.approx(asked[-1], abs=1e-3)


@pytest.mark.parametrize(
    ("share", "burst", "mean"), [(0.05, 1.0, 1.0), (0.2, 4.0, 4.0), (0.8, 1.0, 4.0), (0.9, 2.0, 9.0)]
)
def test_as_many_samples_fall_as_are_asked_for(share: float, burst: float, mean: float) -> None:
    """So many in a row as well, where so few can be that many."""
    y, state = np.ones(200_000), np.zeros(3)
    compiled(EFFECT_STAGES["sensor_dropout"].stage)(y, y, y, state, np.array([share, 0.0, burst, 1.0]), 0.005)
    fallen = y == 0.0
    starts = int(np.sum(fallen[1:] & ~fallen[:-1]))
    assert fallen.mean() == pytest.approx(share, rel=0.05)
    assert fallen.sum() / starts == pytest.approx(mean, rel=0.05)


@pytest.mark.parametrize(("balance", "first", "second"), [(0.0, 1.03, 0.97), (1.0, 1.06, 1.0), (-1.0, 1.0, 0.94)])
def test_a_mismatch_is_one_muscles_or_half_of_it_each_ones(balance: float, first: float, second: float) -> None:
    p1_mpa, p2_mpa, _ = ran("sensor_gain", {"gain": 0.0})
    changed = ran("muscle_mismatch", {"mismatch": 0.06, "balance": balance})
    np.testing.assert_allclose(changed[0], first * np.array(p1_mpa))
    np.testing.assert_allclose(changed[1], second * np.array(p2_mpa))
