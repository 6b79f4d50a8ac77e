"""A rig in place of one whose simulator answers whole records: for one program, what the simulator says to it.

The simulated rig steps its own model tick by tick; a Python function or an FMU gets the program's set-points at once,
and the loop reads its answer tick by tick (`rig.app.stand_ins.playback`).
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from rig.interfaces import Role
from rig.log.convert import write_record
from rig.model.parameters import Model
from rig.model.simulation import simulate
from rig.realtime.program import Program
from rig.record import Record
from rig.rig_config import DeviceEntry, RigConfig

AFTER_S = 10.0
"""The simulator goes on for so long at the safe pressures, where the loop returns after its program."""
_ROLES = frozenset({Role.VALVE_1, Role.VALVE_2, Role.ANGLE})


@contextmanager
def precomputed(rig: RigConfig, model: Model, program: Program) -> Iterator[RigConfig]:
    """The rig whose angle is what `model` says to `program`; without pressures, for the model says nothing of them."""
    with TemporaryDirectory(prefix="pamrig-") as folder:
        path = Path(folder) / "answer.mcap"
        simulated = simulate(model, commands_of(program, rig))
        write_record(replace(simulated, p1_mpa=None, p2_mpa=None), path, {"simulated": True})
        settings = {"log": str(path), "top_mpa": rig.limits.pressure_mpa[1]}
        yield replace(rig, devices=(DeviceEntry("simulator", "playback", settings, _ROLES),))


def commands_of(program: Program, rig: RigConfig) -> Record:
    """Every set-point of a program that begins at the safe pressures, and these for a while after it."""
    safe = rig.safe.p1_mpa, rig.safe.p2_mpa
    rows = [safe]  # the loop writes these once, in the tick in which it takes up the program
    rows += [program.at(index, safe)[1:] for index in range(program.ticks)]
    rows += [safe] * round(AFTER_S * 1e9 / rig.period_ns)
    p1, p2 = (np.array(column, dtype=np.float64) for column in zip(*rows, strict=True))
    time_s = np.arange(len(p1), dtype=np.float64) * (rig.period_ns / 1e9)
    return Record("answer", time_s, p1 - p2, None, p1, p2)
