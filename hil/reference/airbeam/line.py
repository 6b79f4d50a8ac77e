"""A line between regulator and beam in which waves run. Compiled.

Bilateral delay lines (Auslander 1968; transmission line method: Krus, Jansson, Palmberg and Weddfeldt 1990): what
leaves one end as p + Z q arrives at the other after the time that sound takes, Z being the line's characteristic
impedance. Wall friction is turbulent (Blasius 1913: q^1.75) and sits at both ends, half of it each. Flows are rates of
pressure in a beam at angle zero (MPa/s), Z therefore a time (s): that of the wave over the line's share of that volume.
"""

import math

from hil.reference.airbeam.physics import Physics
from hil.reference.compiling import State, compiled

CELLS = 64
WRITE, INTO_LINE, INTO_BEAM, TO_BEAM, TO_VALVE = 0, 1, 2, 3, 3 + CELLS
"""Of a line: where it is written next, the flows (MPa/s) into both of its ends' neighbours, waves (absolute MPa)."""
LINE_STATES = 3 + 2 * CELLS
BLASIUS = 0.75
LEAST_FLOW = 1e-4


@compiled
def impedance_s(physics: Physics) -> float:
    """Characteristic impedance of the line."""
    return physics.line_s / physics.line_share


@compiled
def admittance(flow: float, physics: Physics) -> float:
    """Flow (MPa/s) per difference (MPa) between a wave and the pressure beyond one end's friction."""
    drag = 0.5 * physics.line_drag * math.pow(abs(flow) + LEAST_FLOW, BLASIUS)
    return 1.0 / (impedance_s(physics) + drag)


@compiled
def arriving(way: int, at: int, s: State, physics: Physics, dt_s: float) -> float:
    """The wave (MPa) that arrives at an end; `way`: TO_BEAM or TO_VALVE."""
    ago = max(1.0, min(CELLS - 2.0, physics.line_s / dt_s))
    whole = math.floor(ago)
    newer = int(s[at + WRITE] - whole) % CELLS
    older, part = (newer - 1) % CELLS, ago - whole
    return (1.0 - part) * s[at + way + newer] + part * s[at + way + older]


@compiled
def send(into_line: float, into_beam: float, at: int, s: State, physics: Physics, dt_s: float) -> None:
    """One step: what arrived goes back with what both ends' flows (MPa/s) add to it."""
    impedance, cell = impedance_s(physics), int(s[at + WRITE])
    at_beam = arriving(TO_BEAM, at, s, physics, dt_s) - 2.0 * impedance * into_beam
    at_valve = arriving(TO_VALVE, at, s, physics, dt_s) + 2.0 * impedance * into_line
    s[at + TO_BEAM + cell], s[at + TO_VALVE + cell] = at_valve, at_beam
    s[at + WRITE] = (cell + 1) % CELLS


@compiled
def still(p_mpa: float, at: int, s: State) -> None:
    """A line at rest at an absolute pressure."""
    for k in range(2 * CELLS):
        s[at + TO_BEAM + k] = p_mpa
