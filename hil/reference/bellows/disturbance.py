"""What can be wrong with this family's rig, as plain numbers: on the set-points' way, in the rig, on the readings' way.

Neutral by default. `other_laws` turns an effect and a size into these; `timing`, `pneumatics`, `mechanics` and
`sensing` read them.
"""

from typing import NamedTuple

from hil.reference.disturbance import Disturbance


class TimingLaw(NamedTuple):
    """Between the controller and the regulators' inputs, and in the clock that stamps the readings."""

    delay_s: float = 0.0
    delay_frame: float = 0.0
    """Mean delay of a set-point that waits for the bus's next frame, and half of a frame's length against it."""
    stale_s: float = 0.0
    stale_share: float = 0.2
    """Age of a frame that is carried out once more, and how often that happens."""
    clock_rate: float = 0.0
    """Mean rate by which the readings' clock runs fast; it ages, from three quarters of it on."""
    lost_share: float = 0.0
    lost_fade: float = 800.0
    """Share of readings that are lost, each channel for itself; it swells and fades within so many."""


class RigLaw(NamedTuple):
    """In the regulators, muscles and joint. Index 1 or 2: the muscle's own."""

    gain_1: float = 0.0
    gain_2: float = 0.0
    gain_bend: float = 0.0
    """Error of the regulator's span, and the power by which it bends, relative to it."""
    offset_1_mpa: float = 0.0
    offset_2_mpa: float = 0.0
    lag_s: float = 0.0
    """Elmore's delay of a signal tube: a ladder of three equal restrictions and volumes."""
    throat_mpa_s: float = 0.0
    """Choked flow of a throat behind the main valves, from the main and from 0.3 MPa absolute. 0: none."""
    weak_exhaust: float = 0.0
    weak_fill: float = 0.0
    """How much less a worn pilot solenoid lets through: by one over one plus this."""
    numb_mpa: float = 0.0
    """Error below which no pilot is pulsed."""
    pilot_supply_mpa: float = 10.0
    """Gauge pressure that feeds the pilots."""
    tank: float = 0.0
    """Fall of a tank's pressure per pressure filled into a muscle; a compressor with a switch fills it up."""
    manifold: float = 0.0
    """Rise of a manifold into which both regulators exhaust, per pressure let out."""
    kink: float = 0.0
    kink_mpa: float = 0.15
    """How much narrower the tube of muscle 1 is below a pressure; above, the kink is open."""
    leak_1: float = 0.0
    leak_2: float = 0.0
    """Choked leak of a muscle through a hole that is as wide as the skin is taut: rate (MPa/s) at 0.3 MPa absolute."""
    wide_1: float = 0.0
    wide_2: float = 0.0
    """By how much wider a muscle's pouches are: force and volume."""
    creep: float = 0.0
    """More creep of the skin, as a strain at the tension of rest in fortieths."""
    stiff: float = 0.0
    """By how much stronger muscles and springs pull, all alike: the joint goes to the same angles, held by more."""
    heat: float = 0.0
    heat_s: float = 30.0
    """Loss of a muscle's force by what warm air is let into it."""
    slip_mm_s: float = 0.0
    slip_n: float = 220.0
    slip_muscle: float = 0.0
    """Speed at which a tendon slides out of its clamp, per 100 N above a force; 0: muscle 1's, 1: muscle 2's."""
    dry_nm: float = 0.0
    """Elasto-plastic friction with Stribeck's rise."""
    damper_nm_s: float = 0.0
    """A damper behind an elastic link."""
    link_kgm2: float = 0.0
    """Mass driven by a link: inertia and its forces depend on the angle."""
    weight_nm: float = 0.0
    weight_rad: float = 0.0
    """A weight on a cord between a lever's end and a fixed pulley."""
    stop_high_rad: float = 10.0
    stop_low_rad: float = -10.0
    """A hard stop with a restitution."""
    loose_kgm2: float = 0.0
    loose_rad: float = 0.05
    """A mass that rattles on the joint, and its clearance to either side."""


class ReadingLaw(NamedTuple):
    """Between the joint and the recorded angle."""

    play_deg: float = 0.0
    play_hz: float = 40.0
    """Clearance of the wiper's shaft, which coasts through it, and the stiffness of its contact."""
    gain: float = 0.0
    gain_pivot_deg: float = 0.0
    """Relative error, and the angle at which it is none."""
    offset_deg: float = 0.0
    drift_deg_min: float = 0.0
    drift_stair_s: float = 1.0
    """Mean slope of a drift in stairs."""
    bend_deg: float = 0.0
    bend_place: float = 0.5
    """Deviation at 40 degrees of a loaded track, and where on it zero is."""
    lag_s: float = 0.0
    """Mean delay of a quick and a slow path side by side."""
    step_deg: float = 0.0
    step_missing: float = 5.0
    """Width of a coarse code, one in so many of which is missing."""
    hum_deg: float = 0.0
    hum_hz: float = 50.0
    noise_deg: float = 0.0
    """Noise of two colours."""
    block_s: float = 0.0
    """The driver takes the mean of so long and shows it for as long."""
    bleed_deg: float = 0.0
    """What the converter keeps of the channel before (the second monitor): degrees at 0.1 MPa off 0.2 MPa."""
    dropout: float = 0.0
    dropout_run: float = 1.0
    dropout_deg: float = 0.0
    """Share of samples at which the wiper jumps off, more so at speed, how many in a row, and where the input floats
    to."""


HEALTHY = Disturbance(TimingLaw(), RigLaw(), ReadingLaw())
