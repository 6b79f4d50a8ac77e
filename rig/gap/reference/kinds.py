"""What may stand for the rig without a gap, by name."""

from enum import StrEnum


class Kind(StrEnum):
    """What stands for the rig without a gap."""

    SESSIONS = "sessions"
    SESSION = "session"
    FINGERPRINT = "fingerprint"
    SIMULATOR = "simulator"

    @property
    def by_days(self) -> bool:
        """Earlier days of the same rig."""
        return self in (Kind.SESSIONS, Kind.SESSION)
