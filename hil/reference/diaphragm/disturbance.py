"""What can be wrong with this family's rig, as plain numbers: on the set-points' way, in the rig, on the readings' way.

Neutral by default. `other_laws` turns an effect and a size into these; `timing`, `regulator`, `pneumatics`, `bearing`,
`mechanics` and `sensing` read them.
"""

from typing import NamedTuple

from hil.reference.disturbance import Disturbance


class TimingLaw(NamedTuple):
    """Between the controller and the regulators' inputs, and in the clock that stamps the readings."""

    delay_s: float = 0.0
    delay_shape: float = 0.0
    """Mean delay of a set-point, and the shape of the gamma law of what of it waits in a queue."""
    gateway_s: float = 0.0
    """Interval at which a gateway hears set-points, between which it goes on as they last went."""
    clock_rate: float = 0.0
    clock_ages_s: float = 3.0
    """Mean rate over a record by which the readings' clock runs fast, and from when on it ages as the logarithm."""
    lost_share: float = 0.0
    lost_shape: float = 0.6
    lost_all: float = 0.0
    """Share of readings that repeat the one before; gaps between losses are Weibull's, of this shape. 1: all channels,
    0: the angle alone."""


class RigLaw(NamedTuple):
    """In the regulators, cylinders and joint. Index 1 or 2: the cylinder's own."""

    gain_1: float = 0.0
    gain_2: float = 0.0
    gain_bend: float = 0.0
    """Error of the span ahead of a comparator, and how it swells in the middle of the range, relative to it."""
    offset_1_mpa: float = 0.0
    offset_2_mpa: float = 0.0
    amplifier_s: float = 0.0
    """Mean time constant of a compensated amplifier: one part is quick and one slow."""
    jet_mpa_s: float = 0.0
    """Jet in a dome's line, as the rate of pressure from a full main. 0: none."""
    silencer: float = 0.0
    strainer: float = 0.0
    """Resistance in series with the relief or the feed, against a poppet's conductance."""
    sticky_mpa: float = 0.0
    """Whole play of a stem whose O-ring sticks; the program is told to leave it alone."""
    dome_limit_mpa: float = 10.0
    """Gauge pressure from which on a dome gives way."""
    dryer_mpa: float = 0.0
    """What a membrane dryer takes of the main at a flow of 1 MPa/s."""
    pitot_mpa: float = 0.0
    """Ram pressure at a flow of 1 MPa/s, at a sensor's tap that faces it."""
    weep_1_mpa_s: float = 0.0
    weep_2_mpa_s: float = 0.0
    """Rate of a dome's pressure by a feed solenoid that weeps."""
    wide_1: float = 0.0
    wide_2: float = 0.0
    """By how much wider a diaphragm is."""
    leak_1: float = 0.0
    leak_2: float = 0.0
    leak_at_m: float = 0.0
    """Pinhole which the bore covers until the lobe has rolled by: rate (MPa/s) at 0.3 MPa absolute; and where it is."""
    vent_s: float = 0.0
    vent_cylinder: float = 0.0
    """Within which the air behind a piston leaves through a vent that is nearly blocked."""
    rubber: float = 0.0
    """More of the rubber's fractional derivative."""
    stiff: float = 0.0
    """More cylinders side by side on a stronger spring: force and volume; friction and mass as before."""
    heat: float = 0.0
    heat_s: float = 15.0
    """Force that cylinder 1 loses to heat, and within which its diaphragm takes most of that; cylinder 2 loses less."""
    dry_nm: float = 0.0
    damper_nm_s: float = 0.0
    """Friction of a tight bearing; a damper that resists more one way."""
    sledge_kgm2: float = 0.0
    """Mass that the yoke pushes along, as the joint has it at angle zero."""
    load_nm: float = 0.0
    load_rad: float = 0.0
    """A chain on an arm, of which the less lies on the floor, the higher the arm is."""
    stop_high_rad: float = 10.0
    stop_low_rad: float = -10.0
    """A stack of disc springs."""
    ball_nm: float = 0.0
    ball_rad: float = 0.0
    """Torque of a ball at the end of the tube in which it rolls, and the angle at which the tube is level."""


class ReadingLaw(NamedTuple):
    """Between the joint and the recorded angle."""

    play_deg: float = 0.0
    play_lean_s: float = 6.0
    """Clearance of a coupling whose spring is weak, and within which that leans it on one flank."""
    gain: float = 0.0
    gain_warms_s: float = 5.0
    """Relative error of the excitation, and within which its reference warms up."""
    offset_deg: float = 0.0
    drift_deg_min: float = 0.0
    """Mean slope over a record of what goes as the root of time."""
    bend_deg: float = 0.0
    bend_at_deg: float = 0.0
    """Deviation at that end of +-40 degrees where it is more, of a track that was joined of two at an angle."""
    lag_s: float = 0.0
    lag_uneven: float = 0.0
    """Mean time constant of a follower, and by which share it is slower upwards."""
    step_deg: float = 0.0
    step_bridge: float = 0.2
    """Pitch of a wound track, and the share of it over which the wiper bridges two turns."""
    hum_deg: float = 0.0
    hum_hz: float = 50.0
    hum_slip_hz: float = 2.0
    """Hum of a motor, and with what of its slip it swells."""
    noise_deg: float = 0.0
    noise_grain: float = 0.5
    """Noise, and the share of its power that is the track's grain, the same whenever the wiper comes by."""
    dropout: float = 0.0
    dropout_longest: float = 3.0
    """Share of samples at which the wiper is off, and how many in a row at most; it goes to one end or the other."""
    pickup_deg: float = 0.0
    """What the solenoids' leads induce in the wiper's, per MPa/s."""
    wander: float = 0.0
    wander_s: float = 3.0
    """Relative standard deviation of an excitation that wanders, and how slowly."""


HEALTHY = Disturbance(TimingLaw(), RigLaw(), ReadingLaw())
