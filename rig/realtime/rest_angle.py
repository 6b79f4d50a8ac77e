"""The angle at rest, which a program takes for its zero: experiment step 1 of the paper."""

from typing import Final

from rig.interfaces import Measurement
from rig.sample import ANGLE_ABSENT, SUSPECT, Phase

_ZERO: Final = Phase.ZERO


class RestAngle:
    """Averages the angle in the phase ZERO of one program; 0 until that is over."""

    def __init__(self) -> None:
        self.deg = 0.0
        self.known = False
        self._sum, self._count = 0.0, 0

    def take(self, phase: Phase, now: Measurement, flags: int) -> None:
        """One tick of the program."""
        if self.known:
            return
        if phase is _ZERO:
            if not flags & (SUSPECT | ANGLE_ABSENT):
                self._sum += now.angle_deg
                self._count += 1
        elif phase > _ZERO and self._count:
            self.deg, self.known = self._sum / self._count, True
