"""A device from outside: a joint on two springs, for want of real terminals in an example.

What the loop may rely on is written at `rig.interfaces.Device`; `tests/contract` in pamrig's repository holds this
device to it.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from rig.errors import DeviceError, DeviceLost
from rig.fields import bounded
from rig.interfaces import DeviceContext, Measurement, Role
from rig.sample import P1_ABSENT, P2_ABSENT

HIGHEST_MPA = 0.9
"""What the springs bear."""
ABSENT = {Role.MONITOR_1: P1_ABSENT, Role.MONITOR_2: P2_ABSENT}
"""A monitor that the rig does not want is not there."""


@dataclass(frozen=True)
class SpringSettings:
    """What stands under the device in a rig's YAML; checked before anything is opened."""

    gain_deg_per_mpa: float = bounded(1.0, 1000.0, "deg/MPa", default=100.0)


class SpringRig:
    """A joint that turns in proportion to the difference of the pressures."""

    Settings = SpringSettings

    def __init__(self, settings: SpringSettings, context: DeviceContext) -> None:
        self.roles = context.roles
        self._gain = settings.gain_deg_per_mpa
        self._safe = context.safe_p1_mpa, context.safe_p2_mpa
        self._pressures = self._safe
        self._open = False
        self._absent = sum(flag for role, flag in ABSENT.items() if role not in context.roles)

    @property
    def setpoints_mpa(self) -> tuple[float, float]:
        """What stands at the outputs, for tests."""
        return self._pressures

    def open(self) -> Mapping[str, str]:
        self._open = True
        return {"device": "springs"}

    def read(self) -> Measurement:
        if not self._open:
            raise DeviceLost("spring_rig: read before open")
        p1, p2 = self._pressures
        seen_1, seen_2 = (
            pressure if role in self.roles else math.nan
            for role, pressure in ((Role.MONITOR_1, p1), (Role.MONITOR_2, p2))
        )
        return Measurement(
            p1_mpa=seen_1, p2_mpa=seen_2, angle_deg=self._gain * (p1 - p2), p1_raw=seen_1, p2_raw=seen_2,
            angle_raw=p1 - p2, flags=self._absent,
        )  # fmt: skip

    def write(self, p1_cmd_mpa: float, p2_cmd_mpa: float) -> None:
        if not self._open:
            raise DeviceLost("spring_rig: write before open")
        if not (math.isfinite(p1_cmd_mpa) and math.isfinite(p2_cmd_mpa)):
            raise DeviceError(f"spring_rig: set-points {p1_cmd_mpa} and {p2_cmd_mpa} MPa are no numbers")
        self._pressures = _clamped(p1_cmd_mpa), _clamped(p2_cmd_mpa)

    def safe(self) -> None:
        self._pressures = self._safe

    def close(self) -> None:
        self._open = False


def _clamped(set_point_mpa: float) -> float:
    """Inside the device's own range, whatever the rig's envelope is."""
    return min(max(set_point_mpa, 0.0), HIGHEST_MPA)
