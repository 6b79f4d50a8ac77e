"""The gap of the smoothed angle before and after the causes are in the simulator, and when that is enough."""

from dataclasses import dataclass

from rig.gap.settings import ABOVE_FLOOR, LARGE_GAP, LEAST_EXPLAINED


@dataclass(frozen=True)
class SmoothedGap:
    """Of all records together, rms in deg."""

    before_deg: float
    after_deg: float
    """What the kept effects leave in the simulator; the gap itself where none goes into it."""
    floor_deg: float
    """What healthy records differ by."""

    @property
    def was_above(self) -> bool:
        """The gap stands above the floor."""
        return self.before_deg > ABOVE_FLOOR * self.floor_deg

    @property
    def stays_above(self) -> bool:
        """What is left of it stands above the floor."""
        return self.after_deg > ABOVE_FLOOR * self.floor_deg

    @property
    def shrinks(self) -> bool:
        """The kept effects close some of it."""
        return self.after_deg < self.before_deg

    @property
    def explained_fraction(self) -> float:
        """(G - E) / (G - F) in mean squares, where the gap G stands above the floor F; else (G - E) / G. E is what is
        left."""
        closed = self.before_deg**2 - self.after_deg**2
        if self.was_above:
            return min(closed / (self.before_deg**2 - self.floor_deg**2), 1.0)
        return 1.0 - (self.after_deg / self.before_deg) ** 2

    @property
    def closes_little(self) -> bool:
        """Less than LEAST_EXPLAINED of what stands above the floor is closed, in degrees and not in their squares: more
        is then unexplained than explained, however rough a law may be."""
        return self.before_deg - self.after_deg < LEAST_EXPLAINED * (self.before_deg - self.floor_deg)

    def is_explained_too_little(self, share: float) -> bool:
        """Whether the kept effects close less than they leave. Where they close nothing, it is too little if the gap is
        large, or if one of them closes less than half of what it was found on (`share`: of the effect that closes
        least)."""
        if self.shrinks:
            return self.closes_little
        return share < LEAST_EXPLAINED or self.after_deg > LARGE_GAP * self.floor_deg
