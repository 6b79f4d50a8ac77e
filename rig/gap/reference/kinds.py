"""What may stand for the rig without a gap, by name."""

from enum import StrEnum


class Kind(StrEnum):
    """What stands for the rig without a gap."""

    SESSIONS = "sessions"
    SESSION = "session"
    FINGERPRINT = "fingerprint"
    SIMULATOR = "simulator"
