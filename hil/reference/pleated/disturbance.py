"""What can be wrong with this family's rig, as plain numbers: on the set-points' way, in the rig, on the readings' way.

Neutral by default. `other_laws` turns an effect and a size into these; `timing`, `pneumatics`, `mechanics` and
`sensing` read them.
"""

from typing import NamedTuple

from hil.reference.disturbance import Disturbance


class TimingLaw(NamedTuple):
    """Between the controller and the regulators' inputs, and in the clock that stamps the readings."""

    delay_s: float = 0.0
    delay_apart: float = 0.0
    """Mean delay of a set-point; it takes one of two routes for a while, that differ from it by this share."""
    backlog_s: float = 0.0
    backlog_every_s: float = 3.0
    """A queue that grows to twice `backlog_s` and is emptied at once."""
    clock_rate: float = 0.0
    """Mean rate by which the readings' clock runs fast; a third of it comes and goes within 13 s."""
    lost_share: float = 0.0
    lost_run: float = 2.0
    lost_all: float = 0.0
    """Share of readings that repeat the last valid one, in runs up to so long; 1: all channels, 0: the angle alone."""


class RigLaw(NamedTuple):
    """In the regulators, muscles and joint. Index 1 or 2: the muscle's own."""

    gain_1: float = 0.0
    gain_2: float = 0.0
    gain_bend: float = 0.0
    """Error of the regulator's span, a sixth less at first, and how it grows with the set-point, relative to it."""
    offset_1_mpa: float = 0.0
    offset_2_mpa: float = 0.0
    lag_s: float = 0.0
    """Sum of three unequal time constants on the set-point."""
    rate_mpa_s: float = 0.0
    """Largest rate of the set-point, approached softly. 0: none."""
    narrow_exhaust: float = 0.0
    narrow_fill: float = 0.0
    """How much narrower a small opening of that edge is; fully open it is as before."""
    idle_mpa: float = 0.0
    """Errors below about this hardly count, softly."""
    ceiling_mpa: float = 10.0
    """Gauge set-point that is not exceeded, rounded off within 4 kPa."""
    line: float = 0.0
    """Sag of a long supply line with inertia, per flow."""
    cross_talk: float = 0.0
    """Change of set-point 1 that also reaches valve 2, for a tenth of a second."""
    leak_1: float = 0.0
    leak_2: float = 0.0
    """Turbulent leak of a muscle: rate (MPa/s) at 0.2 MPa gauge."""
    short_1: float = 0.0
    short_2: float = 0.0
    """By how much weaker a membrane is that was cut too short; its force also ends earlier."""
    fold_play_mpa: float = 0.0
    """Play of the pressure that acts on the membranes: folds that stick until they are pushed."""
    creep: float = 0.0
    """More creep of the membranes under load, as a strain at 350 N in twentieths."""
    stiff: float = 0.0
    """By how much stronger muscles and springs pull, all alike: the joint goes to the same angles, held by more."""
    heat: float = 0.0
    heat_s: float = 30.0
    """Loss of force when the air works; the heat of its compression."""
    dry_nm: float = 0.0
    """Rate-and-state friction."""
    film_nm_s: float = 0.0
    """Drag of a lubricant's film that gives way at speed."""
    load_kgm2: float = 0.0
    """Mass at the end of an elastic shaft."""
    weight_nm: float = 0.0
    weight_rad: float = 0.0
    """A weight behind a gear of 1.3."""
    stop_high_rad: float = 10.0
    stop_low_rad: float = -10.0
    """A wire that comes taut."""
    one_way_nm_s: float = 0.0
    """A freewheel that drags in one direction."""
    absorber_kgm2: float = 0.0
    absorber_hz: float = 2.0
    """A mass on a spring that is tuned to the rig's own motion."""


class ReadingLaw(NamedTuple):
    """Between the joint and the recorded angle."""

    play_deg: float = 0.0
    play_back_s: float = 0.8
    """Clearance of the encoder's shaft, which creeps back to the middle of it."""
    gain: float = 0.0
    gain_wave: float = 0.0
    """Relative error, and how much it swings over the angle, relative to it."""
    offset_deg: float = 0.0
    drift_deg_min: float = 0.0
    """Drift with a slow swing on it; its mean slope."""
    bend_deg: float = 0.0
    bend_rad: float = 0.0
    """Error three times per turn."""
    lag_s: float = 0.0
    """Delay at rest of a second-order filter with a damping of 0.9."""
    step_deg: float = 0.0
    step_dither: float = 0.0
    """Width of a coarse code, and the noise ahead of it as a share of that."""
    hum_deg: float = 0.0
    hum_hz: float = 50.0
    noise_deg: float = 0.0
    """Noise that is loud and quiet in turns."""
    tilt_deg_s: float = 0.0
    """Error (deg) at 1 rad/s in either direction: the magnet tilts."""
    dropout: float = 0.0
    dropout_run: float = 1.0
    dropout_deg: float = 0.0
    """Share of samples whose parity is wrong, in pairs and triples at most, and the value that stands there."""


HEALTHY = Disturbance(TimingLaw(), RigLaw(), ReadingLaw())
