"""What can be wrong with this family's rig, as plain numbers: on the set-points' way, in the rig, on the readings' way.

Neutral by default. `other_laws` turns an effect and a size into these; `timing`, `regulator`, `pneumatics`,
`mechanics` and `sensing` read them.
"""

from typing import NamedTuple

from hil.reference.disturbance import Disturbance


class TimingLaw(NamedTuple):
    """Between the controller and the regulators' inputs, and in the clock that stamps the readings."""

    delay_s: float = 0.0
    delay_collide: float = 0.0
    """Mean delay of a set-point, and the share of telegrams that collide (once more each) and back off, ever longer."""
    waypoint_s: float = 0.0
    """Interval of the waypoints between which an interpolator draws straight lines."""
    clock_rate: float = 0.0
    clock_oven_s: float = 6.0
    """Mean rate by which the readings' clock runs fast; its oven is switched on and off within so long."""
    lost_share: float = 0.0
    lost_tail: float = 1.5
    lost_all: float = 0.0
    """Share of readings that repeat the one before in outages of any length (Pareto, with this exponent); 1: all
    channels, 0: the angle alone."""


class RigLaw(NamedTuple):
    """In the regulators, beams and joint. Index 1 or 2: the beam's own."""

    gain_1: float = 0.0
    gain_2: float = 0.0
    gain_bend: float = 0.0
    """Error of a regulator's own sensor, and how a bridge out of balance bends it, relative to it."""
    offset_1_mpa: float = 0.0
    offset_2_mpa: float = 0.0
    mean_s: float = 0.0
    """Delay of a mean of the last set-points in a regulator's program."""
    stroke_mpa_s: float = 0.0
    """Stroke of a spool that meets a limiter, as the rate of pressure from a full main. 0: none."""
    felt_out: float = 0.0
    felt_in: float = 0.0
    """Resistance of a clogged felt behind the exhaust or before the inlet."""
    exception_mpa: float = 0.0
    """Change from which on the regulator's sensor sends at all."""
    limiter_mpa: float = 10.0
    """Gauge pressure at which a limiting valve has closed the inlet."""
    bottle: float = 0.0
    """Air of a beam against that of a small compressor's bottle, in percent."""
    ground_mpa: float = 0.0
    """Error of a regulator's sensor at the full current of the other one's coil: a ground that both share."""
    bridge: float = 0.0
    """Leak from beam to beam: rate of pressure (MPa/s) per difference of the squares of absolute pressure."""
    leak_1: float = 0.0
    leak_2: float = 0.0
    """Pores in the crease, which open as a beam is folded: rate (MPa/s) at 0.3 MPa absolute, angle zero."""
    far_1: float = 0.0
    far_2: float = 0.0
    """By how much further from the hinge a beam is sewn on."""
    pinch_s: float = 0.0
    pinch_beam: float = 0.0
    """Within which the air behind the crease of a beam follows that before it, at angle zero."""
    creep: float = 0.0
    """More creep, against the beams' stiffness."""
    stiff: float = 0.0
    """More beams side by side on a stronger bush: torque and volume; friction and mass as before."""
    heat: float = 0.0
    heat_s: float = 20.0
    """Torque that beam 1 loses to heat that soaks into its fabric, after so long; beam 2 loses half of it."""
    dry_nm: float = 0.0
    """Friction of a tight bearing that sticks the firmer, the longer it rests."""
    oil_nm_s: float = 0.0
    """Drag of an oil that its own shear warms."""
    paddle_kgm2: float = 0.0
    """Water that a paddle moves."""
    load_nm: float = 0.0
    load_rad: float = 0.0
    """A weight at the end of a leaf that bends."""
    stop_high_rad: float = 10.0
    stop_low_rad: float = -10.0
    """A block of rubber."""
    catch_nm: float = 0.0
    catch_rad: float = 0.0
    """Largest pull of a magnet towards an angle."""


class ReadingLaw(NamedTuple):
    """Between the joint and the recorded angle."""

    play_deg: float = 0.0
    play_shake: float = 0.1
    """Clearance of the resolver's shaft, which is shaken to and fro in it: by this share of it within a second."""
    gain: float = 0.0
    gain_rad: float = 0.0
    """Relative error of the sine winding's amplitude, and the electrical angle at the joint's zero."""
    offset_deg: float = 0.0
    drift_deg_min: float = 0.0
    drift_from: float = 0.2
    """Mean slope of a clamp that begins to slide at a share of the record, and then does so evenly."""
    bend_deg: float = 0.0
    bend_rad: float = 0.0
    """Deviation at that end of +-40 degrees where it is more: a short rod drives the resolver."""
    lag_s: float = 0.0
    """Delay of a long cable: resistance and capacitance all along it."""
    step_deg: float = 0.0
    step_apart: float = 0.3
    """Width of a coarse code of two converters that take turns, and how far apart they are in codes."""
    hum_deg: float = 0.0
    hum_hz: float = 50.0
    hum_hunt_s: float = 3.0
    """Hum of a generating set, and within which its governor hunts."""
    noise_deg: float = 0.0
    """Noise by which the tracking rings."""
    ring_hz: float = 0.0
    """Natural frequency of a tracking that overshoots. 0: none."""
    echo: float = 0.0
    echo_s: float = 0.4
    """Share of an old reading that is left in a buffer, and how old it is."""
    dropout: float = 0.0
    dropout_run: float = 1.0
    dropout_deg: float = 0.0
    """Share of samples at which the tracking falls into a false null, how many in a row, and where that lies."""


HEALTHY = Disturbance(TimingLaw(), RigLaw(), ReadingLaw())
