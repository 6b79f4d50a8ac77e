"""What the rigs of the modelled world do alike as devices: they are functions of the clock and of what was written, and
keep set-points, the safe state and whether they are open. What moves, and what its sensors show, each brings itself.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, ClassVar, Generic, Self, TypeVar

from rig.errors import DeviceError, DeviceLost
from rig.interfaces import Abilities, Clock, DeviceContext, Measurement, Role
from rig.sample import P1_ABSENT, P2_ABSENT

_REGULATOR_MPA = 0.5  # top of the ITV1030/2030's range

SettingsT = TypeVar("SettingsT")


class ModelledRig(Abilities, ABC, Generic[SettingsT]):
    """A whole rig whose plant advances in steps of `step_ns`: at each call it is taken to the clock's now under the
    set-points that stood meanwhile. It never sleeps."""

    device: ClassVar[str]
    """What it is called in messages."""
    second_path = False
    """Its plant lives in the loop's process: nobody else can write to it."""

    def __init__(
        self,
        settings: SettingsT,
        context: DeviceContext,
        step_ns: int,
        step: Callable[[float, float], tuple[float, float, float]],
    ) -> None:
        """`step`: both set-points (MPa) -> p1, p2 (MPa), angle (deg) one step later."""
        self.roles = context.roles
        self._settings, self._context, self._clock = settings, context, context.clock
        self._missing = (0 if Role.MONITOR_1 in self.roles else P1_ABSENT) | (
            0 if Role.MONITOR_2 in self.roles else P2_ABSENT
        )
        self._command = (context.safe_p1_mpa, context.safe_p2_mpa)
        self._step, self._step_ns = step, step_ns
        self._state = step(*self._command)
        self._plant_ns: int | None = None
        self._open = False

    @abstractmethod
    def facts(self) -> Mapping[str, str]:
        """What a record says of it."""

    @abstractmethod
    def read(self) -> Measurement:
        """The plant now."""

    def open(self) -> Mapping[str, str]:
        """Start the plant's time, or let it go on from where it was closed."""
        self._open = True
        if self._plant_ns is None:
            self._plant_ns = self._clock.now_ns()
        return self.facts()

    def twin(self, clock: Clock) -> Self:
        """Another such rig on another clock: for whoever wants to call one without an effect on this one."""
        kind: Any = type(self)
        made: Self = kind(self._settings, replace(self._context, clock=clock))
        return made

    def write(self, p1_cmd_mpa: float, p2_cmd_mpa: float) -> None:
        """The set-points stand from now on, inside the regulators' range; DeviceError for one that is not finite."""
        if not self._open:
            raise DeviceLost(f"{self.device}: write before open")
        self._advance()
        if not (0.0 <= p1_cmd_mpa <= _REGULATOR_MPA and 0.0 <= p2_cmd_mpa <= _REGULATOR_MPA):
            if not (math.isfinite(p1_cmd_mpa) and math.isfinite(p2_cmd_mpa)):
                raise DeviceError(f"{self.device}: a set-point is not finite; nothing was written")
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

    def _now(self) -> tuple[float, float, float]:
        """p1, p2 (MPa) and angle (deg) of the plant at the clock's now; DeviceLost before `open`."""
        if not self._open:
            raise DeviceLost(f"{self.device}: read before open")
        self._advance()
        return self._state

    def _advance(self) -> None:
        if self._plant_ns is None:
            return
        now_ns = self._clock.now_ns()
        while self._plant_ns + self._step_ns <= now_ns:
            self._state = self._step(*self._command)
            self._plant_ns += self._step_ns
