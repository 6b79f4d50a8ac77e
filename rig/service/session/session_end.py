"""What became of a rig when its session ended, as far as the session has seen it at the device."""

from dataclasses import dataclass, field
from typing import Final

from rig.realtime.safe_report import SafeReport

NEVER_TICKED: Final = "the loop never ticked, and nothing was written to the rig"


@dataclass(frozen=True)
class SessionEnd:
    """What a session leaves behind. Its defaults are those of a session whose loop never ticked."""

    ticked: bool = False
    """Whether the loop had ever ticked: before, it writes nothing."""
    report: SafeReport = field(default_factory=SafeReport)
    """What was known of the safe state."""
    insisted: str = ""
    """How it went where the device had to be waited for to take it, for the end of a line."""

    @property
    def unsafe(self) -> bool:
        """The rig was under way, and nobody has seen to its safe state since."""
        return self.ticked and not self.report.safe

    @property
    def words(self) -> str:
        """For a person: what is known of the rig, and who says so."""
        return f"{self.report.words}{self.insisted}" if self.ticked else NEVER_TICKED
