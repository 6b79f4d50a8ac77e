"""Gains and limits of the feedback over the angle, as a sweep's YAML and the program in the loop have them."""

from dataclasses import dataclass

from rig.fields import bounded


@dataclass(frozen=True)
class ClosedLoop:
    """Gains and limits of the feedback; the section `closed_loop` of a sweep's YAML."""

    kp_mpa_per_deg: float = bounded(-0.1, 0.1, "MPa/deg")
    ki_mpa_per_deg_s: float = bounded(-1.0, 1.0, "MPa/(deg s)", default=0.0)
    kd_mpa_s_per_deg: float = bounded(-0.01, 0.01, "MPa s/deg", default=0.0)
    filter_s: float = bounded(0.0, 1.0, "s", default=0.02)
    """Time constant of the low-pass on the derivative."""
    limit_mpa: float = bounded(0.0, 1.0, "MPa", default=0.2)
    """The feedback adds no more than this to the differential pressure, whatever the error."""
    error_deg: float = bounded(0.1, 180.0, "deg", default=15.0)
    error_s: float = bounded(0.0, 10.0, "s", default=0.3)
    """An error that is larger than `error_deg` for this long ends in the safe state."""
