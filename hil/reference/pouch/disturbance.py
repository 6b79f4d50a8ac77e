"""What can be wrong with this family's rig, as plain numbers: on the set-points' way, in the rig, on the readings' way.

Neutral by default. `other_laws` turns an effect and a size into these; `timing`, `bank`, `pneumatics`, `rolling`,
`mechanics` and `sensing` read them.
"""

from typing import NamedTuple

from hil.reference.disturbance import Disturbance


class TimingLaw(NamedTuple):
    """Between the controller and the regulators' inputs, and in the clock that stamps the readings."""

    delay_s: float = 0.0
    delay_goes_on_s: float = 0.1
    """Mean delay of a set-point, and for how long a wait that is long or short goes on."""
    turns_s: float = 0.0
    """For how long one regulator alone hears set-points, in turns with the other."""
    clock_rate: float = 0.0
    clock_set_s: float = 3.0
    """Mean rate over a record by which the readings' clock runs fast, and how often, in the mean, it is set anew."""
    lost_share: float = 0.0
    lost_busy: float = 0.5
    lost_all: float = 0.0
    """Share of readings that repeat the one before, and how much of it goes with how quickly they change. 1: all
    channels, 0: the angle alone."""


class RigLaw(NamedTuple):
    """In the regulators, pouches and joint. Index 1 or 2: the muscle's own."""

    gain_1: float = 0.0
    gain_2: float = 0.0
    gain_bend: float = 0.0
    """By how much a sensor in a loop reads too little, and how that fades over its range, relative to it."""
    offset_1_mpa: float = 0.0
    offset_2_mpa: float = 0.0
    lag_s: float = 0.0
    """Time constant of a filter that a diode bridges."""
    budget_mpa_s: float = 0.0
    budget_mpa: float = 0.01
    """Rate of pressure that the protection of a bank's coils allows for long, and what it allows at once. 0: none."""
    pipe_out: float = 0.0
    pipe_in: float = 0.0
    """Length of a pipe behind a bank's exhaust or before its inlet."""
    zone_mpa: float = 0.0
    """Width of a zone in which a bank stays shut, which narrows as long as it does."""
    fold_mpa: float = 10.0
    """Gauge pressure from which on a program asks for less, the more it is asked for."""
    sag_mpa: float = 0.0
    """What hose and receiver take of the main at a flow of 1 MPa/s."""
    wander_mpa: float = 0.0
    wander_s: float = 3.0
    wander_rad: float = 0.0
    """Standard deviation of a sensor's zero that wanders, how slowly, and from where."""
    shut_1: float = 0.0
    shut_2: float = 0.0
    """Share of a row's pouches that are welded shut."""
    leak_1: float = 0.0
    leak_2: float = 0.0
    """Channel in a weld that gapes as the film is taut: rate (MPa/s) at 0.3 MPa absolute and angle zero."""
    peel_mm_s: float = 0.0
    peel_muscle: float = 0.0
    """Rate at which a muscle's welds peel under twice the peel strength."""
    give_mm_n: float = 0.0
    give_muscle: float = 0.0
    """Give of a muscle's anchor, which is late."""
    creep: float = 0.0
    """More of the film's delayed strain."""
    stiff: float = 0.0
    """More rows side by side on stronger cords: force and volume; friction and mass as before."""
    heat: float = 0.0
    heat_s: float = 8.0
    """Stiffness that the film of muscle 1 loses to the sun, and when half of that is lost; muscle 2 loses less."""
    dry_nm: float = 0.0
    """Friction of rolls that rub on their guides."""
    squeeze_nm_s: float = 0.0
    """Drag of grease between the rolls, in a gap that is narrower off the middle."""
    outer_kgm2: float = 0.0
    """Mass far out on the link, as the joint has it at angle zero."""
    load_nm: float = 0.0
    load_rad: float = 0.0
    """A weight on the link, which rolls: by half of the angle and by the whole."""
    stop_high_rad: float = 10.0
    stop_low_rad: float = -10.0
    """A block of cork."""
    centre_nm: float = 0.0
    """Largest torque of a spring over the centre."""


class ReadingLaw(NamedTuple):
    """Between the joint and the recorded angle."""

    play_deg: float = 0.0
    play_drag: float = 0.2
    """Clearance of the mirror's pin, and the share of the motion that its grease takes along in it."""
    gain: float = 0.0
    gain_day: float = 0.1
    """Relative error by daylight on the detector, and by which share of that it grows over a record."""
    offset_deg: float = 0.0
    drift_deg_min: float = 0.0
    """Mean slope over a record of what begins and ends slowly."""
    bend_deg: float = 0.0
    bend_tilt: float = 0.3
    """Deviation at that end of +-40 degrees where it is more, of a detector that stands askew by so much."""
    lag_s: float = 0.0
    lag_tail: float = 0.3
    """Mean delay of a detector in which a share of the carriers diffuses."""
    step_deg: float = 0.0
    step_apart: float = 0.4
    """Code of each of both currents, and how far apart their codes are."""
    hum_deg: float = 0.0
    hum_hz: float = 50.0
    hum_at_deg: float = 0.0
    """Hum of a lamp, which draws the spot towards itself, and where it stands."""
    noise_deg: float = 0.0
    noise_shimmer: float = 0.4
    """Noise, and the share of its power that is warm air before the spot."""
    dropout: float = 0.0
    dropout_run: float = 2.0
    """Share of samples at which the beam is interrupted, and how many in a row in the mean; the dark reads anything."""
    range_gain: float = 0.0
    range_deg: float = 15.0
    """By how much the far range of an amplifier is off that switches by itself, and where it does."""
    frame_deg_mpa: float = 0.0
    frame_muscle: float = 0.0
    """By how much the frame of the detector bends under a muscle, and under which."""


HEALTHY = Disturbance(TimingLaw(), RigLaw(), ReadingLaw())
