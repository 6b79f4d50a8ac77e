"""How well a model predicts records: the numbers of Table IV, whether it stays bounded, and whether it is used where it
is valid."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from rig.columns import rms
from rig.identify.records.data import Prepared, RecordOptions, doubts, prepare
from rig.identify.records.rest import at_own_rest
from rig.identify.search.objective import predict
from rig.identify.search.stability import StabilityVerdict, SweepRange, check_bounded
from rig.log.session_times import begun_s
from rig.model.chain import lay_out
from rig.model.driving import driving_pressures
from rig.model.parameters import Input, Model
from rig.model.response.fingerprint_check import fingerprint_trouble
from rig.model.simulation import DIVERGED_DEG, before_sensor, run_stages
from rig.record import Column, Record

_POWER_SHARE = 0.02
"""A frequency counts as part of an excitation when it holds this share of the strongest one's power."""
_ROOM = 1.5
"""Excitation may exceed the valid range by this factor before a warning: ends of a range are seldom hit exactly."""
_OTHER_REST_MPA = 0.02
"""A P0 further than this from the model's is another one, MPa: twice what regulators and monitors differ by between
days (`rig.identify.records.rest.SHIFTED_MPA` is three times it). Only a warning hangs on it."""
LIMIT_FACTOR = 1.5
"""Bounded means: within this many times the largest measured angle, scaled to the sweep's amplitude."""


@dataclass(frozen=True)
class Score:
    """One row of Table IV."""

    log: str
    rmse_deg: float
    nrmse: float
    """RMSE over the peak-to-peak of the measured angle."""
    fit_percent: float
    """100 (1 - |error| / |measured - its mean|): 100 is exact, 0 no better than the mean, below 0 worse."""
    max_deg: float
    diverged: bool
    command_rmse_deg: float | None = None
    """The same for the whole chain from the command, where the model is driven by pressures."""


@dataclass(frozen=True)
class Validation:
    """A model on some records."""

    scores: list[Score]
    verdict: StabilityVerdict
    warnings: list[str] = field(default_factory=list)


def score(name: str, measured: Column, simulated: Column, skip: int = 0) -> Score:
    """The figures of one record; both columns in degrees, shape (n,)."""
    diverged = not bool(np.all(np.abs(simulated) < DIVERGED_DEG))
    wanted = measured[skip:]
    error = np.clip(np.nan_to_num(simulated[skip:], nan=DIVERGED_DEG), -DIVERGED_DEG, DIVERGED_DEG) - wanted
    rmse = rms(error)
    spread = float(np.ptp(wanted))
    deviation = float(np.linalg.norm(wanted - np.mean(wanted)))
    fit = 100.0 * (1.0 - float(np.linalg.norm(error)) / deviation) if deviation > 0 else float("nan")
    return Score(name, rmse, rmse / spread if spread > 0 else float("nan"), fit, float(np.max(np.abs(error))), diverged)


def validate(
    model: Model, records: Sequence[Record], sweep: SweepRange, options: RecordOptions | None = None
) -> Validation:
    """Score `model` on each record, driven as it was identified, and check it over the sweep range."""
    records, rests = at_own_rest(records)
    prepared = [prepare(record, model, options) for record in records]
    scores = [_score_of(model, each, at_s) for each, at_s in zip(prepared, begun_s(records).tolist(), strict=True)]
    warnings = doubts(prepared) + [text for each in prepared for text in outside(model, each)]
    warnings += [rests] if rests else []
    warnings += [trouble] if (trouble := fingerprint_trouble(model)) else []
    return Validation(scores, check_bounded(model, sweep, angle_limit(prepared, sweep)), warnings)


def angle_limit(prepared: Sequence[Prepared], sweep: SweepRange) -> float:
    """The angle (deg) beyond which a model of these records is not bounded under that sweep."""
    largest = max(float(np.max(np.abs(each.angle_deg))) for each in prepared)
    amplitude = max(each.amplitude_mpa for each in prepared)
    return LIMIT_FACTOR * largest * max(1.0, sweep.amplitude_mpa / amplitude)


def outside(model: Model, data: Prepared) -> list[str]:
    """Warnings where a record's excitation lies outside what the model was identified for."""
    found, name, valid = [], data.record.name, model.valid
    slow, fast = excited_hz(data.p1_mpa - data.p2_mpa, model.sample_time_s)
    finest = 1.0 / (len(data.p1_mpa) * model.sample_time_s)  # a record cannot place a line more finely than this
    if fast > valid.frequency_hz[1] * _ROOM or slow + finest < valid.frequency_hz[0] / _ROOM:
        allowed = f"{valid.frequency_hz[0]:g} .. {valid.frequency_hz[1]:g} Hz"
        found.append(f"{name}: excited from {slow:.2g} to {fast:.2g} Hz, the model is valid for {allowed}")
    if data.amplitude_mpa > valid.amplitude_mpa * _ROOM:
        found.append(
            f"{name}: |p1 - p2| reaches {data.amplitude_mpa:.3g} MPa, the model is valid up to "
            f"{valid.amplitude_mpa:g} MPa"
        )
    rest = float(np.mean(0.5 * (data.p1_mpa + data.p2_mpa)))
    if data.record.facts.get("p0_mpa") is not None:
        rest = float(data.record.facts["p0_mpa"])
    known = data.record.has_pressures or data.record.p1_cmd_mpa is not None
    if known and abs(rest - model.p0_mpa) > _OTHER_REST_MPA:
        found.append(f"{name}: P0 is {rest:.3g} MPa, the model's is {model.p0_mpa:g} MPa")
    return found


def excited_hz(column: Column, dt_s: float) -> tuple[float, float]:
    """Lowest and highest frequency (Hz) of an excitation (n,) whose lines hold _POWER_SHARE of the strongest one's
    power."""
    window = np.hanning(len(column))
    power = np.abs(np.fft.rfft((column - np.mean(column)) * window)) ** 2
    strong = np.nonzero(power >= _POWER_SHARE * power.max())[0]
    hz = np.fft.rfftfreq(len(column), dt_s)
    # a Hann window spreads a line over two neighbours on each side
    return float(hz[min(strong[0] + 1, len(hz) - 1)]), float(hz[max(strong[-1] - 1, 0)])


def _score_of(model: Model, data: Prepared, at_s: float) -> Score:
    """Of a record that began so long after its session."""
    name = str(data.record.source or data.record.name)
    row = score(name, data.angle_deg, predict(model, data, begun_s=at_s), data.skip)
    if model.muscle.input is Input.COMMAND:
        return row
    p1, p2 = driving_pressures(data.grid, Input.COMMAND, model.p0_mpa)
    angle = np.zeros(len(p1))
    start = before_sensor(model, float(data.angle_deg[0]))
    run_stages(lay_out(model), p1, p2, angle, model.sample_time_s, start, at_s)
    whole = score(name, data.angle_deg, angle, data.skip)
    return Score(**{**row.__dict__, "command_rmse_deg": whole.rmse_deg})
