"""The simulated rig: the model's chain behind the same interface as a real device, with its sensors' noise and counts.

It is a function of time and of what was written: at each read the plant is advanced to the clock's now in whole sample
times of the model, under the set-points that stood meanwhile. It never sleeps, and one seed gives one history.
"""

import math
import random
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeVar

from rig.errors import DeviceError, DeviceLost
from rig.fields import bounded
from rig.interfaces import NAN, Clock, DeviceContext, Measurement, Role
from rig.model.chain import Chain
from rig.model.parameters import AddedEffect, Model, StageModel, load_model
from rig.sample import BROKEN_WIRE, P1_ABSENT, P2_ABSENT


@dataclass(frozen=True)
class SimulatedSettings:
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


_REGULATOR_MPA = 0.5  # top of the ITV1030/2030's range
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


class SimulatedRig:
    """A whole rig in a model: both valves, both monitors and the angle."""

    Settings = SimulatedSettings
    second_path = False
    """Its plant lives in the loop's process: nobody else can write to it."""

    def __init__(self, settings: SimulatedSettings, context: DeviceContext) -> None:
        self.roles = context.roles
        self._settings, self._context, self._clock = settings, context, context.clock
        model = session_model(settings)
        self._chain = Chain(model)
        self._missing = (0 if Role.MONITOR_1 in self.roles else P1_ABSENT) | (
            0 if Role.MONITOR_2 in self.roles else P2_ABSENT
        )
        self._step_ns = round(model.sample_time_s * 1e9)
        self._random = random.Random(settings.seed)
        self._command = (context.safe_p1_mpa, context.safe_p2_mpa)
        self._chain.reset(*self._command)
        self._truth = self._chain.step(*self._command)
        self._plant_ns: int | None = None
        self._open = False
        self.further = tuple(settings.further)
        self._further = tuple(settings.further.get(name, NAN) for name in context.places)
        volts_per_count = _CONVERTER_V / (1 << settings.monitor_bits)
        self._top = float((1 << settings.monitor_bits) - 1)
        self._live_zero, self._broken = _MONITOR_LIVE_ZERO_V / volts_per_count, _MONITOR_BROKEN_V / volts_per_count
        self._mpa_per_count = volts_per_count / _MONITOR_VOLTS_PER_MPA
        self._angle_top = float((1 << settings.angle_bits) - 1)
        self._angle_middle = (1 << settings.angle_bits) / 2
        self._deg_per_count = _POTENTIOMETER_DEG / (1 << settings.angle_bits)

    def open(self) -> Mapping[str, str]:
        """Start the plant's time, or let it go on from where it was closed."""
        self._open = True
        if self._plant_ns is None:
            self._plant_ns = self._clock.now_ns()
        return {"device": "simulated rig", "model": self._settings.model.name, "seed": str(self._settings.seed)}

    def read(self) -> Measurement:
        """Advance the plant to now and sample its sensors: noise, counts, and engineering values from counts as a
        driver makes them."""
        if not self._open:
            raise DeviceLost("simulated rig: read before open")
        self._advance()
        p1_mpa, p2_mpa, angle_deg = self._truth
        noise, sigma, mpa_per_count = self._random.gauss, self._settings.pressure_noise_mpa, self._mpa_per_count
        top, live_zero = self._top, self._live_zero
        raw1 = float(round((p1_mpa + noise(0.0, sigma)) / mpa_per_count + live_zero))
        raw2 = float(round((p2_mpa + noise(0.0, sigma)) / mpa_per_count + live_zero))
        turned = angle_deg + self._settings.angle_offset_deg + noise(0.0, self._settings.angle_noise_deg)
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
        return Measurement._make(
            (p1_mpa, p2_mpa, angle_deg, raw1, raw2, raw_angle, NAN, 0, 0, 0, flags, *self._further)
        )

    def twin(self, clock: Clock) -> "SimulatedRig":
        """Another such rig on another clock: for whoever wants to call one without an effect on this one."""
        return SimulatedRig(self._settings, replace(self._context, clock=clock))

    def write(self, p1_cmd_mpa: float, p2_cmd_mpa: float) -> None:
        """The set-points stand from now on, inside the regulators' range; DeviceError for one that is not finite."""
        if not self._open:
            raise DeviceLost("simulated rig: write before open")
        if not (math.isfinite(p1_cmd_mpa) and math.isfinite(p2_cmd_mpa)):
            raise DeviceError("simulated rig: a set-point is not finite; nothing was written")
        self._advance()
        if not (0.0 <= p1_cmd_mpa <= _REGULATOR_MPA and 0.0 <= p2_cmd_mpa <= _REGULATOR_MPA):
            p1_cmd_mpa, p2_cmd_mpa = (
                min(max(p1_cmd_mpa, 0.0), _REGULATOR_MPA),
                min(max(p2_cmd_mpa, 0.0), _REGULATOR_MPA),
            )
        self._command = p1_cmd_mpa, p2_cmd_mpa

    @property
    def setpoints_mpa(self) -> tuple[float, float]:
        """What the regulators follow now."""
        return self._command

    def safe(self) -> None:
        """The safe set-points stand from now on, whatever happened before."""
        if self._open:
            self._advance()
        self._command = self._context.safe_p1_mpa, self._context.safe_p2_mpa

    def holds_safe(self) -> bool:
        """Whether the regulators follow the safe set-points."""
        return self._command == (self._context.safe_p1_mpa, self._context.safe_p2_mpa)

    def close(self) -> None:
        """The plant stays under its last set-points."""
        self._open = False

    def _advance(self) -> None:
        if self._plant_ns is None:
            return
        now_ns = self._clock.now_ns()
        while self._plant_ns + self._step_ns <= now_ns:
            self._truth = self._chain.step(*self._command)
            self._plant_ns += self._step_ns
