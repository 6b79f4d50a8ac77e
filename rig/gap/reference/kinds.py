"""What may stand for the rig without a gap, which of it is taken for a call, and why."""

from enum import StrEnum

from rig.config import suggest
from rig.errors import ConfigError
from rig.model.parameters import Model
from rig.model.response.fingerprint_check import fingerprint_trouble
from rig.number_text import counted

AUTO = "auto"
"""The best that there is."""


class ReferenceKind(StrEnum):
    """What stands for the rig without a gap."""

    SESSIONS = "sessions"
    SESSION = "session"
    FINGERPRINT = "fingerprint"
    SIMULATOR = "simulator"

    @property
    def by_days(self) -> bool:
        """Earlier days of the same rig."""
        return self in (ReferenceKind.SESSIONS, ReferenceKind.SESSION)


def choose(asked: str, model: Model | None, sessions: int) -> ReferenceKind:
    """The reference that is asked for, or the best there is; ConfigError when it cannot be had."""
    trouble = "the model file has none" if model is None or model.fingerprint is None else fingerprint_trouble(model)
    if asked == AUTO:
        if sessions:
            return ReferenceKind.SESSIONS if sessions > 1 else ReferenceKind.SESSION
        return ReferenceKind.SIMULATOR if trouble else ReferenceKind.FINGERPRINT
    if asked not in list(ReferenceKind):
        raise ConfigError(f"reference {asked!r}: {suggest(asked, [AUTO, *ReferenceKind])}")
    kind = ReferenceKind(asked)
    least = {ReferenceKind.SESSIONS: 2, ReferenceKind.SESSION: 1}.get(kind, 0)
    if sessions < least:
        raise ConfigError(f"--reference {kind}: needs {counted(least, 'earlier day')} by --baseline, {sessions} given")
    if kind is ReferenceKind.FINGERPRINT and trouble:
        raise ConfigError(
            f"--reference fingerprint: {trouble}; `pamrig identify` writes one, and `--reference simulator` does "
            "without"
        )
    return kind


def because(asked: str, kind: ReferenceKind, model: Model | None, sessions: int) -> str:
    """How the reference came about, in words."""
    if asked != AUTO:
        made = ", made for another rig of the build or from data sheets" if kind is ReferenceKind.SIMULATOR else ""
        return f"as --reference {asked} asks{made}"
    if kind.by_days:
        return f"because {sessions} {'was' if sessions == 1 else 'were'} given by --baseline"
    if kind is ReferenceKind.FINGERPRINT:
        return "because the model file has one and no earlier day was given"
    lacks = ""
    if model is not None:
        lacks = " and the model file has no fingerprint"
        if model.fingerprint is not None:
            lacks = f" and the model file's fingerprint cannot be used ({fingerprint_trouble(model)})"
    return f"because no earlier day was given{lacks}; --baseline DAY shows far smaller effects"
