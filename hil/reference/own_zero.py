"""A rig whose records each count the angle from where the joint rested before, as those of pamrig's own loop do."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from hil.reference.compiling import Array
from hil.reference.disturbance import Disturbance
from hil.reference.plant import PlantDay, ReferencePlant

REST_S: Final = 0.5
"""For how long the first set-points are held before a record: the mean angle of that time is its zero."""
ZERO: Final = "angle_zero_deg"
"""Column of what was taken for zero, the same in each row; named as the log's field is."""


@dataclass(frozen=True)
class OwnZero:
    """The unit, see hil.reference.families.Unit; whatever turns the joint at rest is in no record of it."""

    unit: ReferencePlant

    def session(self, seed: int, drift: float = 0.004) -> PlantDay:
        return self.unit.session(seed, drift)

    def still(self) -> PlantDay:
        return self.unit.still()

    def simulate(
        self,
        p1_cmd_mpa: Array,
        p2_cmd_mpa: Array,
        period_s: float,
        session: PlantDay,
        disturbance: Disturbance | None = None,
        noise_seed: int = 0,
    ) -> dict[str, Array]:
        rest = max(1, round(REST_S / period_s))
        held = [np.concatenate([np.full(rest, column[0]), column]) for column in (p1_cmd_mpa, p2_cmd_mpa)]
        columns = self.unit.simulate(held[0], held[1], period_s, session, disturbance, noise_seed)
        zero_deg = float(np.mean(columns["angle_deg"][:rest]))
        record = {name: column[rest:] for name, column in columns.items()}
        return record | {
            "t_s": record["t_s"] - rest * period_s,
            "angle_deg": record["angle_deg"] - zero_deg,
            ZERO: np.full(len(record["t_s"]), zero_deg),
        }
