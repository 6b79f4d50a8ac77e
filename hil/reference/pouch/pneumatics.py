"""Flows and air of the ninth family. Compiled.

A valve's flow is that of ISO 6358-1:2013 with a cracking pressure, below which its seat lets nothing by. The tube is
smooth and turbulent, so that the pressure that it takes is the flow to the power 7/4 (Blasius 1913), and laminar where
that is little. A muscle's air has a mass and an energy; heat goes to the film the quicker, the more air is blown in, by
the power 0.8 of the flow (Dittus and Boelter 1930). A long pipe takes of the pressure by the square of the flow. Flows
are rates of pressure in a muscle at angle zero (MPa/s), MASS and HEAT (the air's mass and its energy) are the pressures
that it would have there, at the film's temperature and at its own.
"""

import math

from hil.reference.compiling import State, compiled
from hil.reference.pouch.bank import (
    AIR,
    BEFORE,
    BEHIND,
    FEED,
    HEAT,
    MASS,
    OUTLET,
    REFERENCE_MPA,
    ROOM,
    VALVE_STATES,
    VENT,
    balanced,
    step_control,
)
from hil.reference.pouch.disturbance import RigLaw
from hil.reference.pouch.physics import ATMOSPHERE_MPA, Physics

ATM = ATMOSPHERE_MPA
KAPPA = 1.4
CRITICAL, SUBSONIC, CRACKS_MPA = 0.22, 0.48, 0.002
"""Critical ratio, subsonic index and cracking pressure of a valve."""
BLASIUS, LAMINAR_MPA = 4.0 / 7.0, 0.0006
"""Power of the pressure that a tube's flow goes by, and the pressure below which it is laminar."""
PIPE_MPA, PIPE_SHARE, LEAST_MPA = 0.05, 0.05, 0.12
"""What a pipe of length 1 takes at a flow of 1 MPa/s; the volume of one; the least pressure of a supply."""
GAPES_N_M = 3000.0
"""Tension of the film (N/m) at which a channel in a weld has its nominal gap."""
HOSE, HOSE_SHARE, RECEIVER_SHARE = 0.4, 0.3, 12.0
"""Of what is taken of the main, the hose's share; volumes of the manifold behind it and of the receiver before."""

SUPPLY = 2 * VALVE_STATES
RECEIVER, BUILT = SUPPLY + 1, SUPPLY + 2
"""BUILT: volume (m^3) of a pouch of the build at angle zero whose film is not stretched."""
RIG_STATES = SUPPLY + 3


@compiled
def valve_flow(upstream: float, downstream: float) -> float:
    """Flow between two absolute pressures, against the choked one from there."""
    if downstream <= CRITICAL * upstream:
        return 1.0
    shuts = 1.0 - CRACKS_MPA / upstream
    off = (downstream / upstream - CRITICAL) / (shuts - CRITICAL)
    return 0.0 if off >= 1.0 else math.pow(1.0 - off * off, SUBSONIC)


@compiled
def tube_flow(first: float, second: float, physics: Physics) -> float:
    """Flow (MPa/s) through the tube from one absolute pressure to another."""
    off = abs(first - second)
    turbulent = math.pow(max(off, LAMINAR_MPA) / physics.tube_mpa, BLASIUS)
    return math.copysign(turbulent * min(1.0, off / LAMINAR_MPA), first - second)


@compiled
def slit_flow(leak: float, tension_n_m: float, p: float) -> float:
    """Flow (MPa/s) out of a muscle through a channel in a weld, whose gap goes with the film's tension (Poiseuille: the
    cube of the gap, and the difference of the squares of pressure)."""
    gap = min(3.0, tension_n_m / GAPES_N_M)
    return leak * gap * gap * gap * (p * p - ATM * ATM) / (REFERENCE_MPA * REFERENCE_MPA - ATM * ATM)


@compiled
def step_pipes(fed: float, vented: float, at: int, s: State, rig: RigLaw, supply: float, dt_s: float) -> None:
    """One implicit step of the air in both pipes: before a bank's inlet and behind its exhaust."""
    if rig.pipe_in > 0.0:
        drop = PIPE_MPA * rig.pipe_in
        comes = math.sqrt(max(0.0, supply - s[at + BEFORE]) / drop)
        slope = 0.5 / math.sqrt(drop * max(1e-5, supply - s[at + BEFORE]))
        way = dt_s * (comes - fed) / (PIPE_SHARE + dt_s * slope)
        s[at + BEFORE] = max(LEAST_MPA, min(supply, s[at + BEFORE] + way))
    else:
        s[at + BEFORE] = supply
    if rig.pipe_out > 0.0:
        drop = PIPE_MPA * rig.pipe_out
        goes = math.sqrt(max(0.0, s[at + BEHIND] - ATM) / drop)
        slope = 0.5 / math.sqrt(drop * max(1e-5, s[at + BEHIND] - ATM))
        s[at + BEHIND] = max(ATM, s[at + BEHIND] + dt_s * (vented - goes) / (PIPE_SHARE + dt_s * slope))


@compiled
def step_air(into: float, lost: float, room: float, at: int, s: State, physics: Physics, dt_s: float) -> None:
    """One step of a muscle's air under a flow from the tube and one that is lost (MPa/s), at its volume against that at
    angle zero: mass, energy, work, heat to the film."""
    warm = s[at + HEAT] / s[at + MASS]
    out = max(0.0, -into) + lost
    blown = math.pow(into, 0.8) if into > 0.0 else 0.0
    pace = dt_s / physics.walls_s * (1.0 + physics.jet * blown)
    s[at + MASS] = max(0.02, s[at + MASS] + dt_s * (into - lost))
    work = (KAPPA - 1.0) * (room - s[at + ROOM]) / (room + s[at + ROOM])
    s[at + HEAT] *= (1.0 - work) / (1.0 + work)  # (before / now)^(kappa - 1), to the third order
    carried = KAPPA * (max(0.0, into) - out * warm)
    s[at + HEAT] = max(0.015, (s[at + HEAT] + dt_s * carried + pace * s[at + MASS]) / (1.0 + pace))
    s[at + ROOM] = room
    s[at + AIR] = max(0.5 * ATM, s[at + HEAT] / room)


@compiled
def step_regulator(
    set_mpa: float, time_s: float, room: float, lost: float, valve: int, s: State, physics: Physics, rig: RigLaw,
    dt_s: float
) -> float:  # fmt: skip
    """One step of a regulator, its tube and its muscle's air, which loses a flow (MPa/s); returns what it took from the
    supply (MPa/s)."""
    at, size = valve * VALVE_STATES, 1.0 if valve == 0 else physics.ratio_2
    step_control(set_mpa, time_s, s[SUPPLY], valve, s, physics, rig, dt_s)
    outlet = s[at + OUTLET]
    fed = vented = 0.0
    if s[at + FEED] > 0.0:
        choked = size * physics.feed_mpa_s * s[at + FEED] * s[at + BEFORE] / physics.main_mpa
        fed = choked * valve_flow(s[at + BEFORE], outlet)
    if s[at + VENT] > 0.0:
        choked = size * physics.vent_mpa_s * s[at + VENT] * outlet / REFERENCE_MPA
        vented = choked * valve_flow(outlet, s[at + BEHIND])
    step_pipes(fed, vented, at, s, rig, s[SUPPLY], dt_s)
    through = tube_flow(outlet, s[at + AIR], physics)
    gives = abs(through) / max(LAMINAR_MPA, abs(outlet - s[at + AIR]))
    rise = dt_s * (fed - vented - through) / (physics.outlet_share + dt_s * gives)
    s[at + OUTLET] = outlet + rise
    step_air(through + gives * rise, lost, room, at, s, physics, dt_s)
    return fed


@compiled
def step_supply(demand: float, s: State, physics: Physics, rig: RigLaw, dt_s: float) -> None:
    """One implicit step of a receiver that the main refills, and of a manifold that hangs on it by a hose."""
    if rig.sag_mpa <= 0.0:
        return
    hose, main = HOSE * rig.sag_mpa, (1.0 - HOSE) * rig.sag_mpa
    comes = (s[RECEIVER] - s[SUPPLY]) / hose
    s[SUPPLY] = max(LEAST_MPA, s[SUPPLY] + dt_s * (comes - demand) / (HOSE_SHARE + dt_s / hose))
    comes, filled_by = (s[RECEIVER] - s[SUPPLY]) / hose, (physics.main_mpa - s[RECEIVER]) / main
    s[RECEIVER] += dt_s * (filled_by - comes) / (RECEIVER_SHARE + dt_s / hose + dt_s / main)


@compiled
def filled(p_mpa: float, room: float, valve: int, s: State, physics: Physics, rig: RigLaw) -> None:
    """A regulator, its tube and its muscle after a long time at a gauge pressure."""
    at, p = valve * VALVE_STATES, p_mpa + ATM
    balanced(p_mpa, valve, s, physics, rig)
    s[at + AIR], s[at + ROOM] = p, room
    s[at + MASS] = s[at + HEAT] = p * room
