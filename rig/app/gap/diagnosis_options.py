"""What `pamrig gap diagnose` is asked for: what all cases of a call have in common, and which cases there are."""

from dataclasses import dataclass
from pathlib import Path

from rig.app.gap.baselines import days_in


@dataclass(frozen=True)
class DiagnosisOptions:
    """What every case of one call has in common."""

    model: Path
    baselines: tuple[Path, ...]
    """Folders of one earlier day each, or of such folders."""
    every_day: bool = False
    """Earlier days that disagree with the others count as well."""
    html_to: Path | None = None
    """Where the report goes; with several cases the overview, and the reports beside it."""
    augmented_to: Path | None = None
    """Where the simulator with the causes goes."""
    retuned_to: Path | None = None
    """Where the simulator goes as it was fitted again to these records."""
    next_to: Path | None = None
    """Where the sweep goes that is recommended, if there is one."""
    no_pressures: bool = False
    """By the angle alone, whatever pressures were measured."""
    effects: tuple[str, ...] = ()
    """The effects that are asked about; empty: all that the rig can have."""
    reference: str = "auto"
    """As `rig.gap.diagnose` takes it."""
    rig: Path | None = None
    """The rig's YAML, for the effects that it can have."""
    tracking: Path | None = None
    """A reference with gains: how much closer the feed-forward would follow with the causes in it."""
    command: str = ""
    """The command line, for the report."""


@dataclass(frozen=True)
class NamedDay:
    """One day's records; `name` goes into the names of its files when there are several."""

    name: str | None
    logs: tuple[Path, ...]


def cases_of(logs: tuple[Path, ...]) -> list[NamedDay]:
    """A single folder that holds days (`days_in`) is a campaign, one case each; anything else is one case."""
    days = days_in(logs[0]) if len(logs) == 1 else []
    return [NamedDay(day.name, (day,)) for day in days] or [NamedDay(None, logs)]
