"""A physics rig behind the interface of a device: a unit of a plant family, which shares no law with the simulator.

For trying what was made on a model against a rig that the model was not made from: `pamrig run`, `identify`, `gap
diagnose` and `track` take it like any other. Time and set-points are those of `hil.bench`.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from rig.errors import DeviceError, DeviceLost
from rig.fields import bounded
from rig.interfaces import NAN, Clock, DeviceContext, Measurement, Role
from rig.sample import P1_ABSENT, P2_ABSENT


@dataclass(frozen=True)
class PhysicsSettings:
    """The physics rig's part of a rig's YAML."""

    family: str = "mckibben"
    unit: int = bounded(0, 2**31 - 1, default=1)
    """Which rig of the family."""
    day: int = bounded(0, 2**31 - 1, default=1)
    """Which day on it: units drift from day to day."""
    drift: float = bounded(0.0, 0.1, "1", default=0.004)
    """How far (relative standard deviation)."""
    effects: dict[str, float] = field(default_factory=dict)
    """What is wrong with it: effects of the family by name, with their sizes."""
    detail_seed: int = bounded(0, 2**31 - 1, default=0)
    """Draws what is no size: which valve, which phase."""
    seed: int = bounded(0, 2**31 - 1, default=1)
    """Of the instruments' noise."""


_REGULATOR_MPA = 0.5  # top of the ITV1030/2030's range


class PhysicsRig:
    """A whole rig in physics: both valves, both monitors and the angle."""

    Settings = PhysicsSettings
    second_path = False
    """Its plant lives in the loop's process: nobody else can write to it."""

    def __init__(self, settings: PhysicsSettings, context: DeviceContext) -> None:
        from hil.reference import families

        self.roles = context.roles
        self._settings, self._context, self._clock = settings, context, context.clock
        wrong = families.disturbance(settings.family, settings.effects, settings.detail_seed)
        day = settings.day, settings.drift
        self._plant = families.stepped(
            settings.family, settings.unit, context.period_ns * 1e-9, day, wrong, settings.seed
        )
        self._missing = (0 if Role.MONITOR_1 in self.roles else P1_ABSENT) | (
            0 if Role.MONITOR_2 in self.roles else P2_ABSENT
        )
        self._command = (context.safe_p1_mpa, context.safe_p2_mpa)
        self._shown = self._plant.step(*self._command)
        self._plant_ns: int | None = None
        self._open = False

    def open(self) -> Mapping[str, str]:
        """Start the plant's time, or let it go on from where it was closed."""
        self._open = True
        if self._plant_ns is None:
            self._plant_ns = self._clock.now_ns()
        named = self._settings
        return {"device": "physics rig", "unit": f"{named.family} {named.unit}", "seed": str(named.seed)}

    def read(self) -> Measurement:
        """Advance the plant to now; its instruments' newest readings."""
        if not self._open:
            raise DeviceLost("physics rig: read before open")
        self._advance()
        p1_mpa, p2_mpa, angle_deg = self._shown
        p1_mpa, p2_mpa = NAN if self._missing & P1_ABSENT else p1_mpa, NAN if self._missing & P2_ABSENT else p2_mpa
        return Measurement(p1_mpa, p2_mpa, angle_deg, p1_mpa, p2_mpa, angle_deg, flags=self._missing)

    def twin(self, clock: Clock) -> "PhysicsRig":
        """Another such rig on another clock: for whoever wants to call one without an effect on this one."""
        return PhysicsRig(self._settings, replace(self._context, clock=clock))

    def write(self, p1_cmd_mpa: float, p2_cmd_mpa: float) -> None:
        """The set-points stand from now on, inside the regulators' range; DeviceError for one that is not finite."""
        if not self._open:
            raise DeviceLost("physics rig: write before open")
        if not (math.isfinite(p1_cmd_mpa) and math.isfinite(p2_cmd_mpa)):
            raise DeviceError("physics rig: a set-point is not finite; nothing was written")
        self._advance()
        self._command = min(max(p1_cmd_mpa, 0.0), _REGULATOR_MPA), min(max(p2_cmd_mpa, 0.0), _REGULATOR_MPA)

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
        while self._plant_ns + self._context.period_ns <= now_ns:
            self._shown = self._plant.step(*self._command)
            self._plant_ns += self._context.period_ns
