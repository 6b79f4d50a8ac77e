"""A rig that is not pneumatic: a motor that follows a set-point in mm, for want of a real one in an example.

Its rig's YAML has a channel map, and the loop knows working values only: the difference of both set-points and an
angle. This device leads from them to mm and back, with the same ranges (docs/decisions/0910 in pamrig's repository).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from rig.channels import Channel, Channels
from rig.errors import ConfigError, DeviceError, DeviceLost
from rig.fields import bounded
from rig.interfaces import DeviceContext, Measurement
from rig.sample import P1_ABSENT, P2_ABSENT


@dataclass(frozen=True)
class MotorSettings:
    """What stands under the device in a rig's YAML; checked before anything is opened."""

    range_mm: tuple[float, float]
    """Of set-point and position, as the rig's channel map says it."""
    answer_s: float = bounded(0.001, 10.0, "s", default=0.05)
    """Time constant of the position loop."""


class MotorRig:
    """A slide that follows its set-point like a lag of first order."""

    Settings = MotorSettings

    def __init__(self, settings: MotorSettings, context: DeviceContext) -> None:
        if not settings.range_mm[0] < settings.range_mm[1]:
            raise ConfigError(f"{context.where}: range_mm: the first value must be the smaller one")
        self.roles = context.roles
        self._range_mm = settings.range_mm
        self._clock, self._answer_s = context.clock, settings.answer_s
        slide = Channel("set_point", "mm", settings.range_mm)
        self._map = Channels(slide, Channel("position", "mm", settings.range_mm))
        self._safe_mm = self._map.own_input(context.safe_p1_mpa - context.safe_p2_mpa)
        self._set_point_mm = self._position_mm = self._safe_mm
        self._moved_ns: int | None = None

    def open(self) -> Mapping[str, str]:
        self._moved_ns = self._clock.now_ns()
        return {"device": "motor"}

    def read(self) -> Measurement:
        position_mm = self._now_mm()
        angle_deg = self._map.working_output(position_mm)
        return Measurement(
            p1_mpa=math.nan, p2_mpa=math.nan, angle_deg=angle_deg, p1_raw=math.nan, p2_raw=math.nan,
            angle_raw=position_mm, flags=P1_ABSENT | P2_ABSENT,
        )  # fmt: skip

    def write(self, p1_cmd_mpa: float, p2_cmd_mpa: float) -> None:
        self._now_mm()
        if not (math.isfinite(p1_cmd_mpa) and math.isfinite(p2_cmd_mpa)):
            raise DeviceError(f"motor_rig: set-points {p1_cmd_mpa} and {p2_cmd_mpa} MPa are no numbers")
        low_mm, high_mm = self._range_mm
        self._set_point_mm = min(max(self._map.own_input(p1_cmd_mpa - p2_cmd_mpa), low_mm), high_mm)

    def safe(self) -> None:
        self._set_point_mm = self._safe_mm

    def close(self) -> None:
        self._moved_ns = None

    def _now_mm(self) -> float:
        """Where the slide is now: it went on since the last call."""
        if self._moved_ns is None:
            raise DeviceLost("motor_rig: not open")
        now_ns = self._clock.now_ns()
        left = math.exp(-(now_ns - self._moved_ns) * 1e-9 / self._answer_s)
        self._position_mm = self._set_point_mm + left * (self._position_mm - self._set_point_mm)
        self._moved_ns = now_ns
        return self._position_mm
