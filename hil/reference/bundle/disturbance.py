"""What can be wrong with this family's rig, as plain numbers: on the set-points' way, in the rig, on the readings' way.

Neutral by default. `other_laws` turns an effect and a size into these; `timing`, `pneumatics`, `strands`, `mechanics`
and `sensing` read them.
"""

from typing import NamedTuple

from hil.reference.disturbance import Disturbance


class TimingLaw(NamedTuple):
    """Between the controller and the regulators' inputs, and in the clock that stamps the readings."""

    delay_s: float = 0.0
    delay_wander: float = 0.0
    """Mean delay of a set-point; a queue fills and empties: its logarithm wanders by so much, within seconds."""
    skew_s: float = 0.0
    """By how much later the second regulator gets its set-point."""
    clock_rate: float = 0.0
    clock_tick_s: float = 0.002
    """Mean rate by which the readings' clock runs fast: it counts ticks of so long too many, or misses them."""
    lost_share: float = 0.0
    lost_fade: float = 6.0
    """Share of packets lost on a radio link whose strength fades and comes back within so many."""


class RigLaw(NamedTuple):
    """In the regulators, bundles and joint. Index 1 or 2: the bundle's own."""

    gain_1: float = 0.0
    gain_2: float = 0.0
    gain_bend: float = 0.0
    """Error of the input amplifier's span, and how it differs at both ends of its range, relative to it."""
    offset_1_mpa: float = 0.0
    offset_2_mpa: float = 0.0
    """Zero of the regulator's own sensor."""
    signal_s: float = 0.0
    """Time constant of a signal volume behind a turbulent restriction, at a difference of 0.05 MPa."""
    profile_mpa_s: float = 0.0
    """Largest rate of a set-point generator that also limits the change of the rate. 0: none."""
    throttle_out: float = 0.0
    throttle_in: float = 0.0
    """More drag of the tube in one direction: a throttle with a check valve, behind the monitor."""
    seat_mpa: float = 0.0
    """Error whose drive a bender needs more, before it lifts."""
    cut_off_mpa: float = 10.0
    """Gauge pressure at which a safety switch closes the supply."""
    droop_s: float = 0.0
    """Fall of the main behind its pressure reducer, per rate of pressure filled into the muscles."""
    neighbour_mpa: float = 0.0
    neighbour_s: float = 3.0
    """Fall of the main whenever another machine draws air, and how often it does."""
    leak_1: float = 0.0
    leak_2: float = 0.0
    """Leak through a slit that opens with the bladder's hoop stretch: rate (MPa/s) at 0.3 MPa absolute, angle zero."""
    torn_1: float = 0.0
    torn_2: float = 0.0
    """Share of a bundle's strands that are torn and plugged, the shortest first."""
    burst: float = 0.0
    burst_s: float = 5.0
    """Share of bundle 1's strands that burst at once, and when."""
    clogged: float = 0.0
    clogged_s: float = 0.3
    """Share of bundle 1's strands that fill through a clogged manifold, and its time constant."""
    creep: float = 0.0
    """More creep of the yarns, as a strain at the force of rest in fortieths."""
    stiff: float = 0.0
    """More strands in both bundles: force, friction of the yarns and volume."""
    heat: float = 0.0
    heat_s: float = 30.0
    """Loss of a bundle's force by the heat of its own friction."""
    dry_nm: float = 0.0
    """Friction of a tight bearing (Bliman and Sorine) at the load of rest."""
    silicone_nm_s: float = 0.0
    """A damper's silicone at rest; it thins when sheared and recovers."""
    wheel_kgm2: float = 0.0
    """A wheel that friction carries along: it creeps, and slips when that is not enough."""
    bob_nm: float = 0.0
    bob_rad: float = 0.0
    """A weight on a string at the end of a lever: it swings."""
    stop_high_rad: float = 10.0
    stop_low_rad: float = -10.0
    """Foam that gives way and recovers slowly."""
    off_centre: float = 0.0
    off_rad: float = 0.0
    """How far, against its radius, the pulley's bore is off its centre, and in which direction."""


class ReadingLaw(NamedTuple):
    """Between the joint and the recorded angle."""

    play_deg: float = 0.0
    play_spread: float = 0.3
    """Mean clearance of a spline's teeth, and by how much they differ from each other."""
    gain: float = 0.0
    gain_breath: float = 0.0
    gain_turn_s: float = 12.0
    """Relative error; the carrier's amplitude breathes by so much of it, within so long."""
    offset_deg: float = 0.0
    drift_deg_min: float = 0.0
    """Mean slope of a shaft that walks in its clamp as it is turned to and fro."""
    bend_deg: float = 0.0
    bend_null_deg: float = 0.0
    """Deviation at 40 degrees beyond the transformer's linear range, and where its middle is."""
    lag_s: float = 0.0
    """Delay of three equal means in series: a slow setting of the converter."""
    step_deg: float = 0.0
    """Width of a code that is cut off towards zero."""
    hum_deg: float = 0.0
    hum_hz: float = 50.0
    hum_every_s: float = 1.3
    """Hum of a heater that is switched on and off for whole waves."""
    noise_deg: float = 0.0
    """Noise of the reference: it multiplies the reading."""
    dropout: float = 0.0
    dropout_run: float = 1.0
    dropout_deg: float = 0.0
    """Share of samples at which a cable breaks contact, more so towards one end, how many in a row, and where to the
    open input goes."""
    beat_deg: float = 0.0
    beat_hz: float = 1.0
    """Error at 40 degrees of a carrier that beats with the converter."""
    slew_deg_s: float = 0.0
    """Speed beyond which the converter's tracking falls behind. 0: none."""


HEALTHY = Disturbance(TimingLaw(), RigLaw(), ReadingLaw())
