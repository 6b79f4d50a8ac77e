"""A rig that is a recording: it shows what a log's sensors saw, tick by tick, whatever is commanded.

For the loop, the guard, the daemon and the live view on the data of a real rig: would this record have been a fault? To
send recorded commands to a rig that answers is another thing: `pamrig replay`.
"""

import math
from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from rig.errors import ConfigError, DeviceError, DeviceLost
from rig.fields import bounded
from rig.interfaces import NAN, Abilities, DeviceContext, Measurement, Role, Wiring
from rig.sample import ABSENT_BY_ROLE

_COLUMNS = {Role.MONITOR_1: "p1_mpa", Role.MONITOR_2: "p2_mpa", Role.ANGLE: "angle_deg"}


@dataclass(frozen=True)
class PlaybackSettings(Wiring):
    """A device of the kind playback."""

    log: Path
    """An MCAP or CSV log; its first record when it holds several."""
    top_mpa: float = bounded(0.1, 1.0, "MPa", default=0.5)
    """Set-points above this are clamped, as a regulator's range does."""


class PlaybackRig(Abilities):
    """Plays one record from the first write on; before that it stands at the record's first row, after its end at the
    last, growing old."""

    Settings = PlaybackSettings
    second_path = False
    """There is nothing outside of the loop's process to reach."""

    def __init__(self, settings: PlaybackSettings, context: DeviceContext) -> None:
        self.roles = context.roles
        self._settings, self._context, self._now = settings, context, context.clock.now_ns
        self._times_ns: list[int] = []
        self._columns: dict[Role, list[float]] = {}
        self._began_ns: int | None = None
        self._open = False
        self.setpoints_mpa = (context.safe_p1_mpa, context.safe_p2_mpa)
        """What was written last; nothing follows it."""

    def open(self) -> Mapping[str, str]:
        """Read the log, the first time; RecordError or ConfigError when it does not hold what the rig's roles need."""
        facts = {"device": "playback of a record", "log": self._settings.log.name}
        if not self._times_ns:
            facts |= self._load()
        self._open = True
        return facts

    def read(self) -> Measurement:
        """The row of this moment; its age is the time since the row was taken."""
        if not self._open:
            raise DeviceLost("playback: read before open")
        passed_ns = 0 if self._began_ns is None else self._now() - self._began_ns
        row = bisect_right(self._times_ns, passed_ns) - 1
        age_ns = passed_ns - self._times_ns[row]
        p1, p2, angle = (self._columns[role][row] if role in self._columns else NAN for role in ABSENT_BY_ROLE)
        flags = sum(
            absent for value, absent in zip((p1, p2, angle), ABSENT_BY_ROLE.values(), strict=True) if math.isnan(value)
        )
        ages = [0 if math.isnan(value) else age_ns for value in (p1, p2, angle)]
        return Measurement(p1, p2, angle, p1, p2, angle, NAN, ages[0], ages[1], ages[2], flags)

    def write(self, p1_cmd_mpa: float, p2_cmd_mpa: float) -> None:
        """Remembered; the first one starts the record."""
        if not self._open:
            raise DeviceLost("playback: write before open")
        if not (math.isfinite(p1_cmd_mpa) and math.isfinite(p2_cmd_mpa)):
            raise DeviceError("playback: a set-point is not finite; nothing was written")
        if self._began_ns is None:
            self._began_ns = self._now()
        top = self._settings.top_mpa
        self.setpoints_mpa = min(max(p1_cmd_mpa, 0.0), top), min(max(p2_cmd_mpa, 0.0), top)

    def safe(self) -> None:
        """Remembered as well; the record goes on."""
        self.setpoints_mpa = self._context.safe_p1_mpa, self._context.safe_p2_mpa

    def close(self) -> None:
        """The record stays where it is."""
        self._open = False

    def _load(self) -> dict[str, str]:
        from rig.log.reader import read

        record = read(self._settings.log, None)[0]
        for role, name in _COLUMNS.items():
            column = getattr(record, name)
            if role in self.roles and column is None:
                raise ConfigError(
                    f"{self._settings.log}: holds no {name}, which the role {role.value} needs; leave the role out"
                )
            if role in self.roles:
                self._columns[role] = column.tolist()
        self._times_ns = [round(t_s * 1e9) for t_s in (record.t_s - record.t_s[0]).tolist()]
        return {"record": record.name, "rows": str(len(record))}
