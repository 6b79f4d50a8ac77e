"""The simulated rig: the model's chain behind the same interface as a real device, with its sensors' noise and counts.

It advances in whole sample times of the model, see hil.modelled_rig; one seed gives one history.
"""

import math
import random
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Self, TypeVar

from hil.modelled_rig import ModelledRig
from rig.fields import bounded
from rig.interfaces import NAN, Clock, DeviceContext, Measurement, Wiring
from rig.model.chain import Chain, place_effect, stage_of
from rig.model.parameters import AddedEffect, Model, StageModel, load_model
from rig.model.slots import Placed
from rig.sample import BROKEN_WIRE, P1_ABSENT, P2_ABSENT


@dataclass(frozen=True)
class SimulatedSettings(Wiring):
    """The simulated rig's part of a rig's YAML."""

    model: Path
    """Model of the chain from set-point to angle."""
    effects: list[AddedEffect] = field(default_factory=list)
    """Effects of the library to add to the model's own: a rig that is not what its model says."""
    drift: float = bounded(0.0, 0.1, "1", default=0.0)
    """How far gains and time constants wander from one session to the next (relative standard deviation; each seed is a
    session)."""
    seed: int = bounded(0, 2**63 - 1, default=1)
    pressure_noise_mpa: float = bounded(0.0, 0.1, "MPa", default=0.0004)
    angle_noise_deg: float = bounded(0.0, 10.0, "deg", default=0.03)
    monitor_bits: int = bounded(8, 24, default=12)
    angle_bits: int = bounded(8, 24, default=14)
    """The potentiometer's converter: 12 bits are 0.084 degrees a count."""
    angle_offset_deg: float = bounded(-170.0, 170.0, "deg", default=3.0)
    """Sensor angle at rest: the rig is not mounted at its sensor's zero."""
    further: dict[str, float] = field(default_factory=dict)
    """What its further channels read: name -> value."""


_MONITOR_VOLTS_PER_MPA = 8.0  # 1-5 V over 0-0.5 MPa, as the regulators' monitor outputs
_MONITOR_LIVE_ZERO_V = 1.0
_MONITOR_BROKEN_V = 0.5
_CONVERTER_V = 5.0
_POTENTIOMETER_DEG = 345.0  # electrical angle of the WDD35D8, mid-scale is 0 degrees


def session_model(settings: SimulatedSettings) -> Model:
    """The model as this session finds it: with the effects added, and each scale drifted a little from its nominal
    value."""
    model = load_model(settings.model)
    wander = random.Random(f"drift {settings.seed}")
    return replace(
        model,
        valve=_drifted(model.valve, settings.drift, wander),
        muscle=_drifted(model.muscle, settings.drift, wander),
        effects=[*model.effects, *settings.effects],
    )


def _apart(model: Model) -> tuple[Model, list[Placed]]:
    """The model without the effects that are in the samples alone, and those: they act on what the converter read, its
    noise included. A sample that is lost repeats the whole reading."""
    readings = [effect for effect in model.effects if stage_of(effect).in_samples]
    others = [effect for effect in model.effects if not stage_of(effect).in_samples]
    return replace(model, effects=others), [place_effect(effect, {}) for effect in readings]


_StageT = TypeVar("_StageT", bound=StageModel)


def _drifted(stage: _StageT, drift: float, wander: random.Random) -> _StageT:
    """Gains, time constants and the angle's scale times 1 + drift * N(0, 1); all else as it was."""
    parameters = {
        name: replace(parameter, value=parameter.value * (1 + drift * wander.gauss(0.0, 1.0)))
        if name.endswith(("_gain", "_tau_s")) or name == "y_unit_deg"
        else parameter
        for name, parameter in stage.parameters.items()
    }
    return replace(stage, parameters=parameters)


def normal_numbers(source: random.Random) -> Iterator[float]:
    """Of mean 0 and deviation 1: those of `source.gauss`, bit by bit, in two thirds of its time."""
    while True:
        turn = 2.0 * math.pi * source.random()
        reach = math.sqrt(-2.0 * math.log(1.0 - source.random()))
        yield math.cos(turn) * reach
        yield math.sin(turn) * reach


class SimulatedRig(ModelledRig[SimulatedSettings]):
    """A whole rig in a model: both valves, both monitors and the angle."""

    Settings = SimulatedSettings
    device = "simulated rig"

    def __init__(self, settings: SimulatedSettings, context: DeviceContext, model: Model | None = None) -> None:
        """`model`: the session's, where it has been read already."""
        self._model = session_model(settings) if model is None else model
        model, readings = _apart(self._model)
        chain = Chain(model)
        chain.reset(context.safe_p1_mpa, context.safe_p2_mpa)
        super().__init__(settings, context, round(model.sample_time_s * 1e9), chain.step)
        self._readings = [(placed.stage, [0.0] * placed.n_state, placed.params) for placed in readings]
        self._dt_s = model.sample_time_s
        self._noise = normal_numbers(random.Random(settings.seed)).__next__
        self.further = tuple(settings.further)
        self._further = tuple(settings.further.get(name, NAN) for name in context.places)
        volts_per_count = _CONVERTER_V / (1 << settings.monitor_bits)
        self._top = float((1 << settings.monitor_bits) - 1)
        self._live_zero, self._broken = _MONITOR_LIVE_ZERO_V / volts_per_count, _MONITOR_BROKEN_V / volts_per_count
        self._mpa_per_count = volts_per_count / _MONITOR_VOLTS_PER_MPA
        self._angle_top = float((1 << settings.angle_bits) - 1)
        self._angle_middle = (1 << settings.angle_bits) / 2
        self._deg_per_count = _POTENTIOMETER_DEG / (1 << settings.angle_bits)

    def twin(self, clock: Clock) -> Self:
        """Another such rig on another clock, of the model that this one has read."""
        return type(self)(self._settings, replace(self._context, clock=clock), self._model)

    def facts(self) -> Mapping[str, str]:
        """Which model it follows."""
        return {"device": self.device, "model": self._settings.model.name, "seed": str(self._settings.seed)}

    def read(self) -> Measurement:
        """Advance the plant to now and sample its sensors: noise, counts, and engineering values from counts as a
        driver makes them."""
        p1_mpa, p2_mpa, angle_deg = self._now()
        noise, sigma, mpa_per_count = self._noise, self._settings.pressure_noise_mpa, self._mpa_per_count
        top, live_zero = self._top, self._live_zero
        raw1 = float(round((p1_mpa + noise() * sigma) / mpa_per_count + live_zero))
        raw2 = float(round((p2_mpa + noise() * sigma) / mpa_per_count + live_zero))
        turned = angle_deg + self._settings.angle_offset_deg + noise() * self._settings.angle_noise_deg
        raw_angle = float(round(turned / self._deg_per_count + self._angle_middle))
        if not (
            0.0 <= raw1 <= top and 0.0 <= raw2 <= top and 0.0 <= raw_angle <= self._angle_top
        ):  # ends of the converters
            raw1, raw2, raw_angle = (
                min(max(raw1, 0.0), top),
                min(max(raw2, 0.0), top),
                min(max(raw_angle, 0.0), self._angle_top),
            )
        p1_mpa, p2_mpa = (raw1 - live_zero) * mpa_per_count, (raw2 - live_zero) * mpa_per_count
        flags = BROKEN_WIRE if raw1 < self._broken or raw2 < self._broken else 0
        if self._missing:
            flags |= self._missing
            p1_mpa, raw1 = (NAN, NAN) if flags & P1_ABSENT else (p1_mpa, raw1)
            p2_mpa, raw2 = (NAN, NAN) if flags & P2_ABSENT else (p2_mpa, raw2)
        angle_deg = (raw_angle - self._angle_middle) * self._deg_per_count
        if self._readings:
            reading = [angle_deg]
            for stage, state, params in self._readings:
                stage([p1_mpa], [p2_mpa], reading, state, params, self._dt_s)
            angle_deg = reading[0]
            raw_angle = float(round(angle_deg / self._deg_per_count + self._angle_middle))
        return tuple.__new__(  # what `_make` does, in half its time
            Measurement, (p1_mpa, p2_mpa, angle_deg, raw1, raw2, raw_angle, NAN, 0, 0, 0, flags, *self._further)
        )
