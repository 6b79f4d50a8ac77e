"""What the simulator says of a record under its commands, and how far it is from the healthy days."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rig.columns import rms
from rig.conditions import taken_rest
from rig.errors import RigError
from rig.gap.records.pairs import Pair, Pairing
from rig.gap.records.reach import beyond_reach, check_reach, is_held, pressure_reach_ratio
from rig.identify.records.rest import SHIFTED_MPA
from rig.model.parameters import Input, Model
from rig.model.simulation import read_at_rest, simulate
from rig.record import Column


def at_rest(model: Model, pairing: Pairing) -> Model:
    """The model with the P0 at which it is asked about these records. It keeps its own where they hold both set-points,
    or lie around several P0s; records that hold only the difference are taken around the pairing's P0."""
    commanded = all(pair.raw.p1_cmd_mpa is not None and pair.raw.p2_cmd_mpa is not None for pair in pairing.pairs)
    rests = [taken_rest(pair.raw, pairing.p0_mpa) for pair in pairing.pairs]
    several = max(rests) - min(rests) > SHIFTED_MPA
    return model if commanded or several else replace(model, p0_mpa=pairing.p0_mpa)


LEAST_OFF = 0.002
"""Share of the motion by which a first reading must be off the joint's rest to be asked where it began."""
Modelled = tuple[Column | None, Column | None, Column]
"""What a model says of one record: p1 and p2 (MPa), where it has regulators, and the angle (deg), (n,) each."""


def modelled(model: Model, pair: Pair) -> Modelled:
    """What the model says under the pair's command, on its grid, from where the healthy rig, or else the record,
    starts."""
    read = [session.angle_deg[0] for session in pair.days] or [pair.case.angle_deg[0]]
    return started(model, pair, Input.COMMAND, float(np.mean(read)))


def started(model: Model, pair: Pair, drive: Input, read_deg: float) -> Modelled:
    """What the model says of a record whose first reading is `read_deg`. Where that is not the joint's rest, either
    friction holds the joint there, and the simulation begins at the reading; or the sensor has moved since, and it
    begins at rest. Both are tried; the better one is that whose error varies less, whatever its mean."""
    own = _on_grid(model, pair, drive, read_deg)
    rest_deg = read_at_rest(model)
    if abs(read_deg - rest_deg) < LEAST_OFF * float(np.ptp(pair.case.angle_deg)):
        return own
    rested = _on_grid(model, pair, drive, rest_deg)
    return min(own, rested, key=lambda one: float(np.std((pair.case.angle_deg - one[2])[pair.used > 0])))


def _on_grid(model: Model, pair: Pair, drive: Input, read_deg: float) -> Modelled:
    simulated = simulate(model, pair.raw, drive=drive, start_deg=read_deg, begun_s=pair.begun_s)
    assert simulated.angle_deg is not None
    own = simulated.t_s - simulated.t_s[0]

    def on_grid(column: Column | None) -> Column | None:
        return None if column is None else np.interp(pair.t_s, own, column)

    return on_grid(simulated.p1_mpa), on_grid(simulated.p2_mpa), np.interp(pair.t_s, own, simulated.angle_deg)


def followed(pairs: Sequence[Pair], simulated: Sequence[Modelled]) -> list[str]:
    """Why the model follows each of the records not at all, empty where it does. ModelError when it must be of another
    rig, by how far it moves in those that it follows."""
    farthest_deg = max(float(np.ptp(pair.case.angle_deg)) for pair in pairs)
    given = [_can_be_given(pair) for pair in pairs]
    ratios = [
        pressure_reach_ratio(one[:2], (pair.case.p1_mpa, pair.case.p2_mpa)) if known else 1.0
        for pair, one, known in zip(pairs, simulated, given, strict=True)
    ]
    if all(given) and is_held([one[2] for one in simulated], [pair.case.angle_deg for pair in pairs]):
        return [""] * len(pairs)
    why = [
        beyond_reach(pair.name, one[2], farthest_deg, ratio)
        for pair, one, ratio in zip(pairs, simulated, ratios, strict=True)
    ]
    kept = [k for k, reason in enumerate(why) if not reason] or list(range(len(pairs)))
    check_reach([simulated[k][2] for k in kept], [pairs[k].case.angle_deg for k in kept], max(ratios[k] for k in kept))
    return why


def _can_be_given(pair: Pair) -> bool:
    """Whether a regulator can be given its set-points; below 0 none can, so the command is in another unit, and how far
    pressures move under it says nothing."""
    return float(min(np.min(pair.u1_mpa), np.min(pair.u2_mpa))) >= 0.0


def misfit_deg(model: Model, pairs: Sequence[Pair], healthy: Sequence[Column]) -> float | None:
    """How far (deg rms) the model as it stands is from the healthy days' angles (n,); None where it cannot be
    simulated.

    No part of the gap: the diagnosis works on differences. The augmented model inherits it.
    """
    try:
        simulated = [modelled(model, pair) for pair in pairs]
        followed(pairs, simulated)
    except RigError:
        return None
    missed = [(one[2] - expected)[pair.used > 0] for one, expected, pair in zip(simulated, healthy, pairs, strict=True)]
    return rms(np.concatenate(missed))
