"""What can be wrong with the physics plant, as plain numbers: on the set-points' way, in the rig, on the readings' way.

Neutral by default. `other_laws` turns an effect and a size into these; `timing`, `integrate` and `sensing` read them.
"""

from typing import NamedTuple

from hil.reference.disturbance import Disturbance


class TimingLaw(NamedTuple):
    """Between the controller and the regulators' inputs, and in the clock that stamps the readings."""

    delay_s: float = 0.0
    delay_spread: float = 0.0
    """Relative standard deviation of each set-point's delay; they arrive in order."""
    stall_s: float = 0.0
    """Length of the pauses in which the newest set-point is held back."""
    stall_every_s: float = 0.0
    clock_rate: float = 0.0
    """How much faster the readings' clock runs than the set-points', relative, as it settles while warming up."""
    repeat: float = 0.0
    """Share of readings that are the previous packet again; they come in bursts."""
    repeat_run: float = 1.0
    """Mean length of a burst."""
    repeat_all: float = 0.0
    """1: the packet holds pressures and angle; 0: the angle alone."""


class RigLaw(NamedTuple):
    """In the regulators, muscles and joint. Index 1 or 2: the muscle's own."""

    gain_1: float = 0.0
    gain_2: float = 0.0
    gain_bend: float = 0.0
    """Curvature of the regulator's own pressure sensor that goes with the gain error, relative to it."""
    offset_1_mpa: float = 0.0
    offset_2_mpa: float = 0.0
    pilot_s: float = 0.0
    """Filling time of the pilot chamber through a laminar restriction: rate proportional to the difference of
    squares."""
    orifice_fill: float = 1.0
    orifice_exhaust: float = 1.0
    """Orifice areas against the healthy ones."""
    keep_bandwidth: float = 0.0
    """1: the spool opens as much further as the orifice is smaller, so that only the largest flow changes."""
    overlap_mpa: float = 0.0
    """Error at which the closed spool opens; it closes again at a quarter of it."""
    relief_mpa: float = 10.0
    """Gauge pressure above which a relief valve bleeds, the more the higher it is pushed."""
    tank: float = 0.0
    """Fall of the tank ahead of the regulators per pressure filled into the muscles; refilled within 0.15 s."""
    leak_1_s: float = 0.0
    leak_2_s: float = 0.0
    """Choked leak ahead of the monitor: rate of pressure per absolute pressure."""
    tap_1: float = 0.0
    tap_2: float = 0.0
    """Leak behind the monitor: relative drop at 0.3 MPa absolute, growing with the square of the pressure."""
    hose_hz: float = 0.0
    hose_damping: float = 1.0
    """A pneumatic line that rings, between regulator input and pilot."""
    hunt_mpa: float = 0.0
    hunt_hz: float = 0.0
    """Limit cycle of the regulators (van der Pol)."""
    braid_1: float = 0.0
    braid_2: float = 0.0
    """Relative change of a muscle's braid angle: strength and the shape of the force law."""
    relaxing: float = 0.0
    """More relaxing springs, as a share of the active stiffness at P0 = 0.2 MPa (about 27 N m/rad)."""
    stiff: float = 0.0
    """By how much stronger muscles and springs pull, all alike: the joint goes to the same angles, held by more."""
    warm_up: float = 0.0
    """Loss of force from cold to warm; the rubber stiffens by three times as much."""
    warm_up_s: float = 30.0
    threshold_mpa: float = 0.0
    """Pressure below which the bladder does not touch the braid."""
    notch: float = 0.0
    notch_rad: float = 0.0
    notch_width_rad: float = 0.1
    """Share of muscle 1's force lost around one contraction (a kink in the bladder)."""
    lugre_nm: float = 0.0
    """Dry friction with pre-sliding and Stribeck effect (LuGre)."""
    grease_nm_s: float = 0.0
    """Shear-thinning drag: torque grows with speed to the power 0.8; the value at 1 rad/s."""
    inertia_kgm2: float = 0.0
    gravity_nm: float = 0.0
    gravity_rad: float = 0.0
    stop_low_rad: float = -10.0
    stop_high_rad: float = 10.0
    """Rubber buffers (Hunt-Crossley)."""
    cog_nm: float = 0.0
    cog_per_rad: float = 0.0
    jam_nm: float = 0.0
    jam_every_s: float = 1.0
    jam_length_s: float = 0.0
    jam_start_s: float = 0.0
    """A brake that grabs now and then."""
    push_nm: float = 0.0
    push_hz: float = 0.0
    """A foreign torque with its own rhythm."""


class ReadingLaw(NamedTuple):
    """Between the joint and the recorded angle."""

    play_deg: float = 0.0
    play_spread: float = 0.0
    """Clearance of the sensor's coupling, and how much wider it is where the teeth are worn (at zero)."""
    gain: float = 0.0
    gain_bend: float = 0.0
    """Cubic bend that goes with the gain error (loaded potentiometer), relative to it at 40 degrees."""
    offset_deg: float = 0.0
    drift_deg: float = 0.0
    drift_s: float = 60.0
    """Final drift and its time constant; it starts at zero with every record."""
    bend_deg: float = 0.0
    bend_rad: float = 0.0
    """Eccentric disc: bend_deg * (sin(2 angle + bend_rad) - linear part)."""
    lag_s: float = 0.0
    lag_poles: float = 2.0
    """Sum of the time constants of equal low-pass poles."""
    step_deg: float = 0.0
    step_uneven: float = 0.0
    """Width of a converter's code and how uneven the codes are."""
    hum_deg: float = 0.0
    hum_hz: float = 50.0
    noise_deg: float = 0.0
    """More noise: heavy-tailed, stronger while moving."""
    dead_low_deg: float = 0.0
    dead_high_deg: float = 0.0
    """A worn spot of the track where the wiper lifts and the last value is held."""
    dropout: float = 0.0
    dropout_run: float = 1.0
    dropout_deg: float = 0.0
    """Share of samples at which the wiper lifts, how many in a row, and the value they fall to."""
    slip_deg: float = 0.0
    slip_at: float = 2.0
    """The coupling slips once, at this share of the record's length."""


HEALTHY = Disturbance(TimingLaw(), RigLaw(), ReadingLaw())
