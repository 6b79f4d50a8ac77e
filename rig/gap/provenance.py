"""Where the fitted numbers of the diagnosis come from: each part of `priors.yaml` with what wrote it, and on what."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

NOT_RECORDED, EVERYTHING = "not recorded", "all"
"""In the provenance of that file: what nobody wrote down, and the path above every other."""


@dataclass(frozen=True)
class Origin:
    """Where one part of the fitted numbers comes from."""

    command: str
    """What wrote it; "by hand" where nothing did."""
    seeds: list[int] = field(default_factory=list)
    """Of the development rigs or cases that it was fitted on."""
    families: list[str] = field(default_factory=list)
    """Of plants, all of which count alike."""
    fitted_on: str = NOT_RECORDED
    """How many rigs, days or cases, and which."""
    since: str = NOT_RECORDED
    """The day from which on it has stood here, with its commit where that is known."""
    see: str = ""
    """Decisions."""


@dataclass(frozen=True)
class FitProvenance:
    """Where the fitted numbers come from. Each command that fits some writes the origin of these, and leaves the
    others."""

    families: list[str]
    units: int
    healthy_records: int
    """Plants, rigs and days that the levels are fitted on."""
    parts: dict[str, Origin] = field(default_factory=dict)
    """What stands under a path of this file, `levels.session.odds` say; the longest path counts."""

    def of(self, path: str) -> Origin | None:
        """The origin of what stands under that path."""
        keys = path.split(".")
        paths = [".".join(keys[:count]) for count in range(len(keys), 0, -1)]
        return next((self.parts[one] for one in (*paths, EVERYTHING) if one in self.parts), None)

    def renewed(self, made: Mapping[str, Origin], untouched: Iterable[str] = ()) -> "FitProvenance":
        """The same with other origins under these paths, and whatever stood under longer ones gone, but for what stands
        under the paths `untouched`."""
        as_before = {path: one for path in untouched if (one := self.of(path)) is not None}
        as_before |= {path: one for path, one in self.parts.items() if _under(path, as_before)}
        beside = {path: one for path, one in self.parts.items() if not _under(path, made)}
        return replace(self, parts={**beside, **made, **as_before})


def _under(path: str, above: Iterable[str]) -> bool:
    return any(f"{path}.".startswith(f"{one}.") for one in above)
