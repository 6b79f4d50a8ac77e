"""What the simulator says of a record under its commands, and how far it is from the healthy days."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rig.columns import rms
from rig.errors import RigError
from rig.gap.records.pairs import Pair, Pairing
from rig.gap.records.usable import check_reach, farther
from rig.model.kernels import simulate
from rig.model.parameters import Model
from rig.record import Column


def at_rest(model: Model, pairing: Pairing) -> Model:
    """The model as it is asked about these records. Its P0 is that of its law of the mean pressure, and stays where the
    records hold set-points; where they hold only their difference, it is around the P0 of these."""
    commanded = all(pair.raw.p1_cmd_mpa is not None and pair.raw.p2_cmd_mpa is not None for pair in pairing.pairs)
    return model if commanded else replace(model, p0_mpa=pairing.p0_mpa)


def modelled(model: Model, pair: Pair) -> tuple[Column | None, Column | None, Column]:
    """What the model says under the pair's command, on its grid, from where the healthy rig, or else the record,
    starts."""
    start = [session.angle_deg[0] for session in pair.sessions] or [pair.case.angle_deg[0]]
    said = simulate(model, pair.raw, start_deg=float(np.mean(start)))
    assert said.angle_deg is not None
    check_motion(pair, (said.p1_mpa, said.p2_mpa), said.angle_deg)
    own = said.t_s - said.t_s[0]

    def on_grid(column: Column | None) -> Column | None:
        return None if column is None else np.interp(pair.t_s, own, column)

    return on_grid(said.p1_mpa), on_grid(said.p2_mpa), np.interp(pair.t_s, own, said.angle_deg)


def check_motion(pair: Pair, pressures: tuple[Column | None, Column | None], angle_deg: Column) -> None:
    """ModelError when a model that says these columns (n,) of a record must be of another rig, by how far they move."""
    case = pair.case
    least_set_mpa = float(min(np.min(pair.u1_mpa), np.min(pair.u2_mpa)))
    check_reach(pair.name, angle_deg, case.angle_deg, farther(pressures, (case.p1_mpa, case.p2_mpa), least_set_mpa))


def misfit_deg(model: Model, pairs: Sequence[Pair], healthy: Sequence[Column]) -> float | None:
    """How far (deg rms) the model as it stands is from the healthy days' angles (n,); None where it cannot be
    simulated.

    No part of the gap: the diagnosis works on differences. The augmented model inherits it.
    """
    try:
        said = [modelled(model, pair)[2] for pair in pairs]
    except RigError:
        return None
    missed = [(angle - expected)[pair.used > 0] for angle, expected, pair in zip(said, healthy, pairs, strict=True)]
    return rms(np.concatenate(missed))
