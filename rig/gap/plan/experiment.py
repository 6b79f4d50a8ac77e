"""An experiment that a plan recommends: the records, what they would tell, and its JSON."""

from dataclasses import dataclass
from typing import Any

from rig.channels import PNEUMATIC, Channels
from rig.excite.sweep import Entry
from rig.gap.plan.candidates import lasting_s, sweep_text
from rig.own_units import own_label


@dataclass(frozen=True)
class Experiment:
    """Records that would part hypotheses."""

    entries: tuple[Entry, ...]
    nats: float
    """Of information, at least; see `entropy`."""
    entropy: float
    """Nats that are open now."""
    confidence: float
    """Probability that the truth is expected to have afterwards."""
    separates: tuple[str, ...]
    """Effects that would be told from each other, the likeliest first."""
    weakest: float
    """Standard deviations between the two of them that lie closest."""

    @property
    def seconds(self) -> float:
        """On the rig."""
        return lasting_s(self.entries)

    def sweep(self, name: str = "next") -> str:
        """It as the text of a sweep."""
        return sweep_text(name, self.entries, self.why())

    def to_json(self, channels: Channels = PNEUMATIC) -> dict[str, Any]:
        """The `next_experiment` of a diagnosis of a rig with these channels."""
        return {
            "config": self.sweep(),
            "separates": list(self.separates),
            "expected_ratio": self.weakest,
            "expected_confidence": self.confidence,
            "information_nats": self.nats,
            "open_nats": self.entropy,
            "minutes": self.seconds / 60.0,
            "needs_reference": False,
            "why": self.why(channels),
        }

    def why(self, channels: Channels = PNEUMATIC) -> str:
        """In one sentence, the amplitudes in the rig's own unit."""
        kinds = ", ".join(dict.fromkeys(own_label(entry.signal.label, channels) for entry in self.entries))
        return f"{kinds} in {self.seconds / 60:.1f} min"
