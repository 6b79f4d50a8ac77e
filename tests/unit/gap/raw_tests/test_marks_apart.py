"""Marks that pass for one another: codes that are cut off for a bend, samples that repeat for a step, hum that is
switched for noise."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.plants.gap_rigs import baselines, session
from support.records.changed_samples import repeating

from rig.columns import rms
from rig.gap import diagnose
from rig.gap.answer.facts import Verdict
from rig.gap.raw_tests.all_tests import read_signatures
from rig.gap.raw_tests.converter_codes import ConverterCode, centred, code_of, cut_off_deg2
from rig.gap.raw_tests.signature import Signature
from rig.gap.raw_tests.spectral_lines import fast_spectra, sidebands_deg2
from rig.gap.records.pairs import pair_up
from rig.model.effect_stages import EFFECT_STAGES
from rig.record import Column, Record

STEP_DEG = 2.0


@cache
def healthy(seed: int = 90) -> list[Record]:
    return session(seed)


def coded(angle: Column, step_deg: float, code: ConverterCode) -> Column:
    """As the simulator's stage codes it."""
    reading = angle.copy()
    EFFECT_STAGES["quantisation"].stage(reading, reading, reading, np.zeros(1), [step_deg, float(code)], 0.005)
    return reading


def read_coarsely(step_deg: float, code: ConverterCode, gain: float = 1.0, zero_deg: float = 0.0) -> list[Record]:
    return [replace(one, angle_deg=coded(gain * one.angle_deg + zero_deg, step_deg, code)) for one in healthy()]


@settings(max_examples=20)
@given(st.floats(0.8, 4.0), st.sampled_from(ConverterCode), st.floats(0.9, 1.1))
def test_a_code_is_found_whatever_the_gain(step_deg: float, code: ConverterCode, gain: float) -> None:
    assert code_of(read_coarsely(step_deg, code, gain), [list(baselines()[0])], step_deg) is code


@given(st.floats(0.15, 0.35))
def test_a_zero_that_is_off_is_no_other_code(steps: float) -> None:
    for off in (steps, -steps):
        said = code_of(
            read_coarsely(STEP_DEG, ConverterCode.NEAREST, zero_deg=off * STEP_DEG), [list(baselines()[0])], STEP_DEG
        )
        assert said is ConverterCode.NEAREST


def test_without_a_healthy_day_the_nearest_code_is_taken() -> None:
    assert code_of(read_coarsely(STEP_DEG, ConverterCode.TOWARDS_ZERO), [], STEP_DEG) is ConverterCode.NEAREST


@pytest.mark.parametrize("code", list(ConverterCode))
def test_in_the_middle_of_its_code_a_reading_is_off_by_rounding_alone(code: ConverterCode) -> None:
    for one, read in zip(healthy(), read_coarsely(STEP_DEG, code), strict=True):
        angle, middle = np.asarray(one.angle_deg), np.asarray(centred(read, STEP_DEG, code).angle_deg)
        wide = np.abs(angle) > STEP_DEG  # the code zero is twice as wide where codes go towards it
        assert np.all(np.abs(middle - angle)[wide] <= 0.5 * STEP_DEG + 1e-9)
        assert rms(np.asarray(read.angle_deg)[wide] - middle[wide]) ** 2 == pytest.approx(cut_off_deg2(STEP_DEG, code))


@pytest.mark.parametrize("code", [ConverterCode.LOWER, ConverterCode.TOWARDS_ZERO])
def test_what_cutting_off_leaves_is_the_converters_and_nothing_elses(code: ConverterCode) -> None:
    """It was a bend of the sensor, and an offset."""
    found = diagnose(None, read_coarsely(STEP_DEG, code), [list(day) for day in baselines()])
    assert [cause.effect for cause in found.causes] == ["quantisation"]
    assert found.verdict is Verdict.EXPLAINED
    assert found.causes[0].parameters["code"].value == code
    assert found.gap.after_deg < 0.6 * found.gap.rms_deg


def marks(change: Callable[[Column, np.random.Generator], Column]) -> dict[str, Signature]:
    """What the raw samples of a changed day show beside healthy days with noise and no step."""
    random = np.random.default_rng(5)
    case = [replace(one, angle_deg=change(np.asarray(one.angle_deg), random)) for one in healthy()]
    read = read_signatures(pair_up(case, [list(day) for day in baselines()], 0.2).pairs)
    return {one.effect or one.test: one for one in read if one.found}


@pytest.mark.parametrize("share", [0.05, 0.3, 0.6, 0.85])
def test_samples_that_repeat_are_neither_a_step_nor_noise_nor_hum(share: float) -> None:
    """Few values are left of a column that mostly repeats, and what stands still and jumps is loud."""
    assert set(marks(repeating(share))) == {"lost_samples"}


@pytest.mark.parametrize("every_s", [0.8, 1.7, 2.5])
@pytest.mark.parametrize("hertz", [50.0, 60.0])
def test_hum_that_is_switched_is_hum_and_no_noise(hertz: float, every_s: float) -> None:
    def switched(angle: Column, _: np.random.Generator) -> Column:
        t = np.arange(len(angle)) * 0.005
        return angle + np.where(t / every_s % 1.0 < 0.5, 0.8 * np.sin(2.0 * np.pi * hertz * t), 0.0)

    found = marks(switched)
    assert set(found) == {"mains_hum"}
    assert found["mains_hum"].variance_deg2 == pytest.approx(0.5 * 0.5 * 0.8**2, rel=0.1)
    assert "comes and goes" in found["mains_hum"].text


def hum(length_s: float, hertz: float, period_s: float = np.inf) -> Record:
    """A joint at rest with hum on its noise; switched on for half of each period."""
    t = np.arange(0.0, length_s, 0.005)
    on = t / period_s % 1.0 < 0.5
    angle = np.where(on, 2.0 * np.sin(2.0 * np.pi * hertz * t), 0.0) + 0.02 * np.random.default_rng(3).normal(
        size=len(t)
    )
    return Record("rest", t, np.zeros_like(t), angle)


@given(length_s=st.floats(2.0, 20.0), hertz=st.floats(49.9, 50.1))
@settings(max_examples=60, deadline=None)
def test_hum_that_stays_does_not_come_and_go(length_s: float, hertz: float) -> None:
    """However short the record, and so however broad its window's main lobe."""
    assert sidebands_deg2(fast_spectra([hum(length_s, hertz)]), 50.0) < 1e-4 * 2.0


@pytest.mark.parametrize("length_s", [4.0, 7.0, 20.0])
def test_hum_that_is_switched_has_sidebands_in_short_records_too(length_s: float) -> None:
    shown = sidebands_deg2(fast_spectra([hum(length_s, 50.0, 0.8)]), 50.0)
    assert shown == pytest.approx(0.25 * 2.0**2 * 0.5, rel=0.25)  # as much as in the line: half of the mean square


def test_records_that_fold_the_line_into_the_motion_tell_nothing_of_its_sidebands() -> None:
    """In rows 19.8 ms apart 50 Hz stand at 0.5 Hz."""
    seen, slow = hum(20.0, 50.0, 0.8), np.arange(0.0, 20.0, 0.0198)
    folded = Record("slow rows", slow, np.zeros_like(slow), np.sin(2.0 * np.pi * 9.0 * slow))
    alone = sidebands_deg2(fast_spectra([seen]), 50.0)
    assert alone > 0.0
    assert sidebands_deg2(fast_spectra([seen, folded]), 50.0) == alone


@pytest.mark.parametrize("louder_deg", [0.0, 0.3])
def test_noise_beside_hum_that_is_switched_is_found(louder_deg: float) -> None:
    def both(angle: Column, random: np.random.Generator) -> Column:
        t = np.arange(len(angle)) * 0.005
        hum = np.where(t / 1.3 % 1.0 < 0.5, 0.8 * np.sin(2.0 * np.pi * 50.0 * t), 0.0)
        return angle + hum + louder_deg * random.standard_normal(len(angle))

    assert ("sensor_noise" in marks(both)) is (louder_deg > 0.0)
