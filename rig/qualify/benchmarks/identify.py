"""`pamrig bench identify`: the paper's search budget against pyswarms, what the machine allows, growth, and quality by
optimiser."""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from statistics import median
from typing import Any

from rig.qualify.benchmarks import figure

UNIT = 1
"""Unit of the physics rig whose 0.5 Hz sine is identified."""
_SEEN_FROM = "rates follow from the times of the same run"
_NUMBA = "compiling is numba's"
ITERATIONS = 1000
"""Of the search that is timed; the default of `pamrig identify`."""
QUALITY_ITERATIONS = 200, 1000
"""After which the error of the search is compared with the peers': a fifth, and all."""
PEER_ITERATIONS = 30
"""Of a peer that is too slow for all; its time is scaled."""
SEEDS = range(1, 21)
IDENTIFY_ROUNDS = 5
"""The best of which counts: other work only ever adds time."""
FRESH = True
"""The first search is timed with no machine code at hand."""
_COMPILE = """
import time, numpy as np
from rig.model.compiled.swarm import lay_inputs, swarm_errors, swarm_peaks
from rig.identify.search.swarm import Swarm
t = np.arange(64) * 0.005
inputs = lay_inputs([np.sin(t)], [np.sin(t)], 0.005, [0])
begun = time.perf_counter()
swarm_errors(np.zeros((9, 16)), inputs); swarm_peaks(np.zeros((9, 16)), inputs)
swarm = Swarm(8, 1); swarm.tell(np.ones(60))
print(time.perf_counter() - begun)
"""


def bench_identify() -> dict[str, Any]:
    """One 10 s record at 5 ms, 60 particles, 1000 iterations: 120 million steps of the modified Bouc-Wen model."""
    for name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    return _budget() | _compile() | _limit() | _growth() | _quality()


def _objective(records: int = 1) -> Any:
    """The objective of the record, laid end to end so many times, without the stability term."""
    from rig.identify.records.data import prepare
    from rig.identify.search.objective import SwarmObjective
    from rig.identify.search.space import Space
    from rig.identify.templates import Template, input_gain, template_model

    record = _record()
    model = template_model(Template(), input_gain([record], 0.2))
    space = Space(model)
    return SwarmObjective(model, space, [prepare(record, model)] * records, None), space


def _record() -> Any:
    from hil.reference.families import unit
    from rig.excite.setpoints import around
    from rig.excite.signals import Sine
    from rig.identify.search.stability import excitation
    from rig.record import Record

    dp = excitation(Sine(0.5, 0.2), 0.005, periods=5.0)[:2000]
    plant = unit("mckibben", UNIT)
    made = plant.simulate(*around(0.2, dp), 0.005, plant.session(1))
    return Record(
        "sine_0.5hz_0.20mpa", made["t_s"], dp, angle_deg=made["angle_deg"], p1_mpa=made["p1_mpa"], p2_mpa=made["p2_mpa"]
    )


def _best_of(work: Callable[[], Any], rounds: int = IDENTIFY_ROUNDS) -> float:
    """The shortest of several times: what is left when the machine's other work is out of the way."""
    times = []
    for _ in range(rounds):
        begun = time.perf_counter()
        work()
        times.append(time.perf_counter() - begun)
    return min(times)


def _budget() -> dict[str, Any]:
    """The whole search, the kernel alone, and the same search by pyswarms on a numpy-vectorised objective."""
    import numpy as np

    from rig.identify.search.one_search import Budget, search
    from rig.identify.search.swarm import Swarm, SwarmSettings

    settings = SwarmSettings(iterations=ITERATIONS)
    objective, space = _objective()
    points = np.random.default_rng(1).random((60, len(space)))

    def kernel() -> None:
        for _ in range(ITERATIONS):
            objective.scores(points)

    objective.scores(points)
    whole = _best_of(lambda: search(objective, Swarm(len(space), 1, settings), Budget(60 * ITERATIONS)))
    bare = _best_of(kernel)
    peer = _best_of(lambda: _pyswarms(objective, len(space)), 2) * ITERATIONS / PEER_ITERATIONS
    steps = 60 * ITERATIONS * 1999
    return {
        "search of 60 x 1000 on 10 s, one core": figure(
            whole,
            "s",
            "pyswarms, numpy-vectorised objective",
            peer,
            goal=0.05,
            limit="the kernel alone",
            limit_value=bare,
            note=f"the peer's {PEER_ITERATIONS} iterations scaled to 1000",
        ),
        "times faster than pyswarms": figure(peer / whole, "1", better="higher", goal=40.0, why=_SEEN_FROM),
        "kernel's share of it": figure(bare, "s", "the whole search", whole),
        "model steps per second in the search": figure(steps / whole, "1/s", better="higher", why=_SEEN_FROM),
    }


def _pyswarms(objective: Any, dimension: int) -> None:
    """pyswarms' global-best swarm with Table II's pulls, over the same equation by numpy: all particles at once, tick
    by tick."""
    import logging

    import numpy as np

    logging.disable(logging.INFO)
    inputs, laws = objective.inputs, objective.law

    def cost(points: Any) -> Any:
        l1, l2, xi1, xi2, phi1, phi2, beta1, beta2 = laws(points)[:8]
        y, total = np.full(len(points), inputs.y[0]), np.zeros(len(points))
        for k in range(1, len(inputs.u)):
            nu, theta = inputs.nu[k], inputs.u[k] - l2 * inputs.u[k - 1]
            y = (
                l1 * y
                + (xi1 + xi2 * nu) * theta
                - (phi1 + phi2 * nu) * np.abs(theta) * y
                - (beta1 + beta2 * nu) * theta * np.abs(y)
            )
            total += (y - inputs.y[k]) ** 2
        return np.nan_to_num(np.sqrt(total / len(inputs.u)), nan=1e6, posinf=1e6)

    with np.errstate(all="ignore"), tempfile.TemporaryDirectory() as folder:
        here = os.getcwd()
        os.chdir(folder)  # it writes report.log where it stands, when it is imported
        try:
            from pyswarms.single import GlobalBestPSO

            options = {"c1": 1.5, "c2": 2.5, "w": 0.9}
            swarm = GlobalBestPSO(60, dimension, options, bounds=(np.zeros(dimension), np.ones(dimension)))
            swarm.optimize(cost, PEER_ITERATIONS, verbose=False)
        finally:
            os.chdir(here)
            logging.disable(logging.NOTSET)


def _compile() -> dict[str, Any]:
    """What the first search of a fresh installation pays, and every later one."""
    with tempfile.TemporaryDirectory() as folder:
        environment = os.environ | ({"NUMBA_CACHE_DIR": folder} if FRESH else {})
        first, again = (
            float(
                subprocess.run(
                    [sys.executable, "-c", _COMPILE], env=environment, capture_output=True, text=True, check=True
                ).stdout
            )
            for _ in range(2)
        )
    return {
        "first compile": figure(first, "s", why=_NUMBA),
        "load of the cached code": figure(again, "s", "first compile", first),
    }


def steps_per_second() -> float:
    """Of the bare kernel on one core, every lane busy."""
    import numpy as np

    from rig.model.compiled.swarm import swarm_errors

    objective, space = _objective()
    table = objective.law(np.random.default_rng(1).random((960, len(space))))
    return 960 * 1999 / _best_of(lambda: swarm_errors(table, objective.inputs))


def _limit() -> dict[str, Any]:
    """Steps a second of the bare kernel with every lane busy."""
    from rig.model.compiled.lanes import WIDTH

    rate = steps_per_second()
    return {
        "kernel alone, one core": figure(rate, "steps/s", better="higher", why=_SEEN_FROM),
        "kernel alone, one lane of one core": figure(
            rate / WIDTH,
            "steps/s",
            better="higher",
            why=_SEEN_FROM,
            note=f"{WIDTH} lanes a register, 16 particles a block",
        ),
    }


def _growth() -> dict[str, Any]:
    """Time of one ask as records, particles and cores grow, against 1 record, 60 particles, 1 core."""
    import numpy as np

    from rig.model.compiled.swarm import cores, swarm_errors

    found: dict[str, Any] = {}

    def seconds(records: int, particles: int, workers: int = 1) -> float:
        objective, space = _objective(records)
        table = objective.law(np.random.default_rng(1).random((particles, len(space))))
        return _best_of(lambda: swarm_errors(table, objective.inputs, workers), 2 * IDENTIFY_ROUNDS)

    one = seconds(1, 60)
    for records in (2, 4, 8):
        found[f"{records} records, 60 particles"] = figure(seconds(records, 60), "s", "1 record, 60 particles", one)
    for particles in (240, 960, 3840):
        found[f"1 record, {particles} particles"] = figure(seconds(1, particles), "s", "1 record, 60 particles", one)
    if cores() > 1:
        alone = seconds(4, 3840)
        half = {"limit": "half of one core's", "limit_value": alone / 2, "goal": alone / 1.9}
        found["4 records, 3840 particles, 2 cores"] = figure(seconds(4, 3840, 2), "s", "1 core", alone, **half)
    return found


def _quality() -> dict[str, Any]:
    """RMSE after the same number of evaluations, 20 seeds of each optimiser, no polish and no stability term.

    A fifth of Table II's budget, because the packages' own overhead makes 20 searches of the whole one take minutes;
    the swarm's inertia falls over that fifth. The swarm is shown with the whole budget too.
    """
    from rig.identify.search.one_search import Budget, search
    from rig.identify.search.optimizers import OPTIMIZERS, make_optimizer
    from rig.identify.search.swarm import SwarmSettings

    found: dict[str, Any] = {}
    middle: list[float] = []
    seconds: list[float] = []
    objective, space = _objective()
    fifth, whole = QUALITY_ITERATIONS
    for name, iterations in (*((name, fifth) for name in OPTIMIZERS), ("pso", whole)):
        settings = SwarmSettings(iterations=iterations)
        budget = Budget(settings.particles * iterations)
        results = [search(objective, make_optimizer(name, len(space), seed, settings), budget) for seed in SEEDS]
        scores = sorted(each.score for each in results)
        middle.append(median(scores))
        seconds.append(median(each.seconds for each in results))
        title = f"{name}, {budget.evaluations} evaluations"
        found[f"RMSE median, {title}"] = figure(
            middle[-1], "deg", "pso", middle[0], seeds=len(scores), best=scores[0], seeded=True
        )
        found[f"RMSE worst, {title}"] = figure(scores[-1], "deg", "its median", middle[-1], seeded=True)
        found[f"seconds, {title}"] = figure(seconds[-1], "s", "pso", seconds[0])
    return found
