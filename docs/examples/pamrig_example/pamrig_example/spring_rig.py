"""A device from outside: a joint on two springs, for want of real terminals in an example.

What the loop may rely on is written at `rig.interfaces.Device`; `tests/contract` in pamrig's repository holds a device
to it.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from rig.errors import DeviceError
from rig.fields import bounded
from rig.interfaces import DeviceContext, Measurement


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

    def open(self) -> Mapping[str, str]:
        self._open = True
        return {"device": "springs"}

    def read(self) -> Measurement:
        if not self._open:
            raise DeviceError("spring_rig: read before open")
        p1, p2 = self._pressures
        return Measurement(
            p1_mpa=p1, p2_mpa=p2, angle_deg=self._gain * (p1 - p2), p1_raw=p1, p2_raw=p2, angle_raw=p1 - p2
        )

    def write(self, p1_cmd_mpa: float, p2_cmd_mpa: float) -> None:
        if not self._open:
            raise DeviceError("spring_rig: write before open")
        self._pressures = p1_cmd_mpa, p2_cmd_mpa

    def safe(self) -> None:
        self._pressures = self._safe

    def close(self) -> None:
        self._open = False
