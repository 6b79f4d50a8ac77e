"""What can be wrong with this family's rig, as plain numbers: on the set-points' way, in the rig, on the readings' way.

Neutral by default. `other_laws` turns an effect and a size into these; `timing`, `regulator`, `pneumatics`,
`mechanics` and `sensing` read them.
"""

from typing import NamedTuple

from hil.reference.disturbance import Disturbance


class TimingLaw(NamedTuple):
    """Between the controller and the regulators' inputs, and in the clock that stamps the readings."""

    delay_s: float = 0.0
    delay_retry: float = 0.0
    """Mean delay of a set-point, and the share of telegrams that are sent once more and take half of it longer."""
    task_s: float = 0.0
    """Period of a slow task that passes the newest set-point on."""
    clock_rate: float = 0.0
    """Mean rate by which the readings' clock runs fast; it goes through the crystal's parabola."""
    lost_share: float = 0.0
    lost_keep: float = 3.0
    lost_all: float = 0.0
    """Share of readings that repeat the one before: while the receiver is busy, only one of so many comes through; 1:
    all channels, 0: the angle alone."""


class RigLaw(NamedTuple):
    """In the regulators, muscles and joint. Index 1 or 2: the muscle's own."""

    gain_1: float = 0.0
    gain_2: float = 0.0
    gain_bend: float = 0.0
    """Error of a force motor's span, and how it grows with the third power of the current, relative to it."""
    offset_1_mpa: float = 0.0
    offset_2_mpa: float = 0.0
    eddy_s: float = 0.0
    """Mean delay of a force motor with a solid core: its flux diffuses."""
    motor_mpa_s: float = 0.0
    """Rate of a stepping motor that turns the set-point's spring, in steps of 1 kPa. 0: none."""
    soaked_exhaust: float = 0.0
    soaked_fill: float = 0.0
    """By how much longer a flow takes, fully open, for a second orifice in series."""
    saver_mpa: float = 0.0
    """A regulator closes when its error has stayed below this for a while, until it exceeds it."""
    pop_mpa: float = 10.0
    """Gauge pressure at which a pop-action relief valve opens; it closes a few per cent further down."""
    receiver: float = 0.0
    """Fall of a receiver's pressure per pressure filled into a muscle; a critical nozzle refills it evenly."""
    ice: float = 0.0
    """By how much ice narrows an exhaust before it breaks off."""
    beam_mpa: float = 0.0
    restart_s: float = 3.0
    restart_valve: float = 0.0
    """A beam out of balance, whose trim starts anew every so often; 0: valve 1's, 1: valve 2's."""
    leak_1: float = 0.0
    leak_2: float = 0.0
    """A crimp that gapes under pressure: rate (MPa/s) at 0.2 MPa gauge."""
    wide_1: float = 0.0
    wide_2: float = 0.0
    """By how much larger a sleeve's radius is: force, volume and rubber."""
    creep: float = 0.0
    """More of the rubber that flows, as a share of the elastic rubber in tenths."""
    stiff: float = 0.0
    """More sleeves side by side on stronger flexures: force and volume; friction and mass as before."""
    heat: float = 0.0
    heat_s: float = 30.0
    """By how much a warm frame stretches the flexures, which stiffens them; heat comes from the regulators' coils."""
    virgin: float = 0.0
    """By how much stiffer rubber is that was never stretched so far (Mullins)."""
    guard_n_mm: float = 0.0
    guard_mm: float = 6.0
    guard_muscle: float = 0.0
    """Stiffness of a guard plate against which a sleeve bulges, and how far from the sleeve's radius it stands."""
    dry_nm: float = 0.0
    """Generalised Maxwell slip with Stribeck's fall."""
    brake_nm_s: float = 0.0
    """Eddy-current brake: drag at low speed per speed."""
    wheel_kgm2: float = 0.0
    """Flywheel behind a gear with losses, as seen by the joint."""
    load_nm: float = 0.0
    load_rad: float = 0.0
    """A half-filled vessel: its weight's lever arm has a second harmonic."""
    stop_high_rad: float = 10.0
    stop_low_rad: float = -10.0
    """A leaf spring that lays itself along a block."""
    groove_mm: float = 0.0
    groove_rad: float = 0.2
    """Length that tendon 1 gives when it jumps into the next groove above an angle; it jumps back below it."""


class ReadingLaw(NamedTuple):
    """Between the joint and the recorded angle."""

    play_deg: float = 0.0
    play_jump: float = 0.1
    """Clearance of the magnet in its holder, and the share of it by which the magnet jumps when it is pushed."""
    gain: float = 0.0
    """Relative error of the magnet's field, ahead of the arc sine that makes an angle of it."""
    offset_deg: float = 0.0
    drift_deg_min: float = 0.0
    drift_walk: float = 0.0
    """Mean slope of a drift that is a random walk, and the walk's spread at the end of 20 s, relative to the drift."""
    bend_deg: float = 0.0
    bend_bias: float = 0.0
    """Deviation at 40 degrees of a Hall element that saturates, and the bias of its field."""
    lag_s: float = 0.0
    """Delay of Bessel's filter of fourth order."""
    step_deg: float = 0.0
    """Width of a coarse code of the field, at zero."""
    hum_deg: float = 0.0
    hum_hz: float = 50.0
    hum_fire: float = 0.2
    """Mains cut by a dimmer, and the share of each half wave that it cuts off."""
    noise_deg: float = 0.0
    """Shot noise."""
    stray_deg_s: float = 0.0
    """Error (deg) per MPa/s by which the pressures' difference changes: the regulators' coils in the Hall element."""
    tracking_per_s: float = 0.0
    """Rate at which the zero follows the angle."""
    knot_deg: float = 0.0
    knot_at_deg: float = 10.0
    """Error of one knot of the table that makes the line straight."""
    dropout: float = 0.0
    dropout_run: float = 3.0
    dropout_deg: float = 0.0
    """Share of samples at which the sensor restarts, each time for so many, and what it reads meanwhile."""


HEALTHY = Disturbance(TimingLaw(), RigLaw(), ReadingLaw())
