"""What can be wrong with this family's rig, as plain numbers: on the set-points' way, in the rig, on the readings' way.

Neutral by default. `other_laws` turns an effect and a size into these; `timing`, `pneumatics`, `mechanics` and
`sensing` read them.
"""

from typing import NamedTuple

from hil.reference.disturbance import Disturbance


class TimingLaw(NamedTuple):
    """Between the controller and the regulators' inputs, and in the clock that stamps the readings."""

    delay_s: float = 0.0
    """Mean delay of a set-point: four fifths fixed, the rest exponential; they arrive in order."""
    beat_s: float = 0.0
    beat_hz: float = 0.0
    """Delay that swings between 0 and twice `beat_s`."""
    clock_rate: float = 0.0
    """Mean rate by which the readings' clock runs fast; it is corrected too little and too much in turns."""
    lost_share: float = 0.0
    lost_every: float = 7.0
    """Readings lost in runs that come with the beat of two clocks, every so many samples; the packet before stands."""


class RigLaw(NamedTuple):
    """In the regulators, muscles and joint. Index 1 or 2: the muscle's own."""

    gain_1: float = 0.0
    gain_2: float = 0.0
    gain_bend: float = 0.0
    """Error of the converter that drives the regulator, and how it grows with the set-point, relative to it."""
    offset_1_mpa: float = 0.0
    offset_2_mpa: float = 0.0
    filter_s: float = 0.0
    """Sum of the two equal time constants of a filter on the set-point."""
    ramp_mpa_s: float = 0.0
    """Largest change of the set-point in the regulator's program, at 0.2 MPa; more above, less below. 0: none."""
    silencer: float = 0.0
    inlet_filter: float = 0.0
    """Clogged exhaust or inlet: the flow falls behind by this share of itself, fully open."""
    insensitive_mpa: float = 0.0
    """Errors below this do nothing, larger ones count from there on."""
    supply_mpa: float = 10.0
    """Gauge pressure of a main that is set too low."""
    hose_drop_mpa: float = 0.0
    """Drop of the shared supply hose when both valves fill fully open; it grows with the square of the flow."""
    leak_1_s: float = 0.0
    leak_2_s: float = 0.0
    """Laminar leak at the muscle: rate at 0.2 MPa gauge, in proportion to the difference of the squares."""
    stiction: float = 0.0
    """Change of the opening below which the spool does not move."""
    weak_1: float = 0.0
    weak_2: float = 0.0
    """Share of a muscle's pressure force that is missing; its membrane is as before."""
    creep: float = 0.0
    """Share of a muscle's stroke by which its length creeps."""
    stiff: float = 0.0
    """By how much stronger muscles and springs pull, all alike: the joint goes to the same angles, held by more."""
    heat: float = 0.0
    heat_s: float = 30.0
    """Loss of force when steadily moved; heat comes from motion."""
    snap: float = 0.0
    snap_mpa: float = 0.2
    """Share of muscle 2's force lost while its bladder is folded: from `snap_mpa` up, until 0.06 MPa below."""
    lockup: float = 0.0
    """Fraction of the stroke at which the meshes lock, as stiffness against contraction (kN per unit of it)."""
    dry_nm: float = 0.0
    """Dry friction with stick (Karnopp), growing with the bearing's load."""
    damper_nm_s: float = 0.0
    """Shock absorber: proportional to speed and its square."""
    arm_kgm2: float = 0.0
    """Inertia of an arm that folds: it depends on the angle."""
    weight_nm: float = 0.0
    weight_rad: float = 0.0
    """A weight on a rope over a cam."""
    stop_low_rad: float = -10.0
    stop_high_rad: float = 10.0
    """Air cushions, ever stiffer."""
    detent_nm: float = 0.0
    detent_rad: float = 0.0
    """A spring that snaps over at one angle."""
    rub_nm: float = 0.0
    rub_rad: float = 0.0
    """Dry friction of a cable that rubs above one angle only."""


class ReadingLaw(NamedTuple):
    """Between the joint and the recorded angle."""

    play_deg: float = 0.0
    play_wave_deg: float = 20.0
    """Clearance of the encoder's gear, by a quarter wider and narrower around the wheel."""
    gain: float = 0.0
    gain_uneven: float = 0.0
    """Relative error, and how much it differs between both sides of zero, relative to it."""
    offset_deg: float = 0.0
    drift_deg_min: float = 0.0
    """Drift that becomes faster; its mean slope over 20 s."""
    bend_deg: float = 0.0
    bend_even: float = 0.0
    """Deviation at 40 degrees, growing with the square on either side; share of it that has the same sign on both."""
    window_s: float = 0.0
    """Length of a moving mean."""
    step_deg: float = 0.0
    step_hold: float = 0.0
    """Width of a coarse code, and the part of it by which the way back is late."""
    hum_deg: float = 0.0
    hum_hz: float = 50.0
    noise_deg: float = 0.0
    ripple_deg: float = 0.0
    ripple_per_deg: float = 0.0
    """Interpolation error of the encoder: a wave over the angle."""
    dropout: float = 0.0
    dropout_run: float = 1.0
    dropout_deg: float = 0.0
    """Share of samples that fall to one value because a contact opens, and how many in a row."""


HEALTHY = Disturbance(TimingLaw(), RigLaw(), ReadingLaw())
