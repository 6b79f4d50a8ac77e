"""The quantisation step: the values that occur lie a constant distance apart."""

import math
from collections.abc import Sequence

import numpy as np

from rig.gap.raw_tests.converter_codes import CUT_OFF, ConverterCode, code_of, cut_off_deg2
from rig.gap.raw_tests.noise_levels import angles_of, level_beside_deg
from rig.gap.raw_tests.settings import (
    COARSER,
    FINE_STEPS_APART,
    LEAST_APART,
    LEAST_GAP,
    LEAST_STEP_DEG,
    OFF_WHOLE,
    STEP_BY_CHANCE,
    STEP_DIGITS,
    STEP_OVER_NOISE,
    WHOLE_STEPS,
)
from rig.gap.raw_tests.signature import Signature, Size, on_days
from rig.gap.raw_tests.statistics import about
from rig.gap.records.settings import FEWEST_VALUES, MOST_DIFFERENT
from rig.record import Column, Record

STEP_TEST = "quantisation step"
"""The test's name."""


def quantisation_step(
    cases: Sequence[Record],
    sessions: Sequence[Sequence[Record]],
    described_deg: float | None = None,
) -> Signature:
    """The test for a step coarser than the baselines'; `described_deg` is the noise that a fingerprint knows of, for
    want of them: a step makes a noise of step / sqrt(12), so a healthy day's was no larger than that allows."""
    step, spread = step_deg(angles_of(cases))
    base = max((step_deg(angles_of(session))[0] for session in sessions), default=0.0)
    known = bool(sessions) or (described_deg is not None and step > COARSER * math.sqrt(12.0) * described_deg)
    by_chance = _by_chance(angles_of(cases), step) if step else 1.0
    found = step > COARSER * base and step > LEAST_STEP_DEG and by_chance < STEP_BY_CHANCE
    found = found and (known or step > STEP_OVER_NOISE * level_beside_deg(step, angles_of(cases)))
    code = code_of(cases, sessions, step) if found else ConverterCode.NEAREST
    on_earlier = on_days(f"{base:.3g} deg" if base else "no step", bool(sessions))
    text = (
        f"the angle takes values {step:.3g} deg apart{on_earlier}"
        if step
        else "no quantisation step shows in the angle"
    )
    text += CUT_OFF[code]
    return Signature(
        STEP_TEST,
        "quantisation",
        found,
        value=step,
        baseline=base,
        unit="deg",
        text=text,
        sizes={"step_deg": about(step, spread, 0.0)} | ({"code": Size(code, code, code)} if code else {}),
        p_value=by_chance,
        variance_deg2=max(step**2 - base**2, 0.0) / 12.0 + cut_off_deg2(step, code) if found else 0.0,
        taken_out_deg2=cut_off_deg2(step, code),
    )


def step_deg(angles: Sequence[Column]) -> tuple[float, float]:
    """(step, its standard deviation) of the values that occur, deg; 0 when they are too many for a step to show."""
    steps = []
    for column in angles:
        angle = column[np.isfinite(column)]
        inner = angle[(angle > angle.min()) & (angle < angle.max())]  # a clipped sensor repeats its ends
        values = np.unique(np.round(inner, STEP_DIGITS))
        if FEWEST_VALUES <= len(values) < MOST_DIFFERENT * len(inner):
            gaps = np.diff(values)
            steps.append(float(np.median(gaps[gaps > LEAST_GAP * np.median(gaps)])))
    if len(steps) <= 0.5 * len(angles):
        return 0.0, 0.0
    return float(np.median(steps)), float(np.std(steps) / np.sqrt(len(steps)))


def code_found(signatures: Sequence[Signature]) -> tuple[float, ConverterCode]:
    """The step (deg) that was found, and how its codes are made; (0, NEAREST) without one."""
    for one in signatures:
        if one.found and one.test == STEP_TEST:
            return one.value, ConverterCode(int(one.numbers.get("code", ConverterCode.NEAREST)))
    return 0.0, ConverterCode.NEAREST


def fine_step_deg(angles: Sequence[Column]) -> float:
    """The step (deg) of a converter so fine that too few values come twice for `step_deg`: where the values that lie
    nearest to each other are whole steps apart. 0 where they are not, as without a converter."""
    steps = [_fine_step(column[np.isfinite(column)]) for column in angles]
    shown = [step for step in steps if step > 0.0]
    return float(np.median(shown)) if len(shown) > 0.5 * len(steps) else 0.0


def _fine_step(angle: Column) -> float:
    values = np.unique(np.round(angle, STEP_DIGITS))
    gaps = np.diff(values)
    if not len(gaps):
        return 0.0
    written = _written_to_deg(values)
    least = float(np.mean(gaps[gaps < gaps.min() + 1.5 * written])) if written else float(gaps.min())
    near = gaps[gaps < (FINE_STEPS_APART + 0.5) * least] / least
    apart = np.round(near)
    off = OFF_WHOLE + written / least
    if len(near) < LEAST_APART or np.mean(np.abs(near - apart) < off) < WHOLE_STEPS:
        return 0.0
    return least * float(np.sum(near) / np.sum(apart))


def _written_to_deg(values: Column) -> float:
    """The last decimal that a file keeps of its angles, deg: a step of 0.0053 is 0.005 and 0.006 in turn with three; 0
    where it keeps all that count."""
    decimals = next(k for k in range(STEP_DIGITS + 1) if np.array_equal(np.round(values, k), values))
    return 0.0 if decimals == STEP_DIGITS else float(10.0**-decimals)


def _by_chance(angles: Sequence[Column], step_deg: float) -> float:
    """Probability that values without any step lie so near to multiples of one (Rayleigh's test of their phases)."""
    values = np.concatenate([np.unique(angle[np.isfinite(angle)]) for angle in angles])
    together = float(np.abs(np.mean(np.exp(2j * np.pi * values / step_deg))))
    return math.exp(-min(len(values) * together**2, 700.0))
