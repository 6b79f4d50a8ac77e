"""`pamrig bench waits` and `check`: what somebody waits for who types a command, from the command to its end, beside
what of it nothing could spare."""

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

from rig.qualify.benchmarks import figure

SWEEP = "gap"
HEALTHY, WORN = "simulated", "simulated_worn"
"""The rig, and as it is when it has changed."""
SEARCH: tuple[str, ...] = ()
"""How its simulator is searched, in the words of `pamrig identify`; its defaults."""
WAITS_DAYS = 6
"""Healthy days that the diagnosis compares with."""
CHECK_CASES = 60
"""Of the blind check; its time is scaled to WHOLE_CHECK. They are of six whole rigs, as nearly all of WHOLE_CHECK are:
of fewer, making the rigs and starting who answers count for more."""
WHOLE_CHECK: Final = 400
"""Cases of the blind check whose results are published."""
_PACKAGES: Final = "import numba, numpy, scipy.fft, scipy.linalg, scipy.ndimage, scipy.optimize, scipy.special"
_PACKAGES_ALONE: Final = "importing numba and SciPy alone"
_READING: Final = """
import sys
from pathlib import Path
import rig.gap.diagnosis
from rig.log.reader import read_all
read_all(map(Path, sys.argv[1:]))
"""


def bench_waits() -> dict[str, Any]:
    """Each command as a process of its own, after all of them have been run once."""
    with TemporaryDirectory(prefix="pamrig-bench-") as folder:
        place = Path(folder)
        _record(place)
        timed(place, "identify", "day_1", *SEARCH, "-o", "model.yaml")
        return {name: row for part in PARTS for name, row in part(place).items()}


def bench_check() -> dict[str, Any]:
    """Six minutes of the blind check, of which once is enough."""
    with TemporaryDirectory(prefix="pamrig-bench-") as folder:
        return checked(Path(folder))


def _record(place: Path) -> None:
    """A session of a rig that has changed, and the healthy days before it, in virtual time."""
    days = [(f"day_{seed}", HEALTHY, seed) for seed in range(1, WAITS_DAYS + 1)]
    for name, rig, seed in (*days, ("worn", WORN, WAITS_DAYS + 1)):
        timed(place, "run", SWEEP, "--rig", rig, "--clock", "virtual", "--seed", f"{seed}", "-o", name)


def diagnosed(place: Path) -> dict[str, Any]:
    """`gap diagnose` of a session beside the healthy days; its first run, which fills caches, is not counted."""
    days = [f"day_{day}" for day in range(1, WAITS_DAYS + 1)]
    baselines = [word for day in days for word in ("--baseline", day)]
    words = ("gap", "diagnose", "--model", "model.yaml", "--log", "worn", *baselines, "--json", "gap.json")
    timed(place, *words)
    return {
        f"gap diagnose, {WAITS_DAYS} days": figure(
            timed(place, *words),
            "s",
            _PACKAGES_ALONE,
            _python(place, "-c", _PACKAGES),
            goal=1.2,
            limit="its imports, and reading the records, alone",
            limit_value=_python(place, "-c", _READING, "worn", *days),
        )
    }


def identified(place: Path) -> dict[str, Any]:
    """`identify` of a session; the limit is every step of the model in all lanes of all cores."""
    from rig.log.reader import read
    from rig.model.compiled.swarm import cores
    from rig.qualify.benchmarks.identify import steps_per_second

    seconds = timed(place, "identify", "day_1", *SEARCH, "-o", "again.yaml", "--json", "identified.json")
    evaluations = json.loads((place / "identified.json").read_text(encoding="utf-8"))["evaluations"]
    ticks = sum(len(record) for record in read(place / "day_1"))
    return {
        "identify of a session": figure(
            seconds,
            "s",
            _PACKAGES_ALONE,
            _python(place, "-c", _PACKAGES),
            goal=2.5,
            limit="its steps of the model in all lanes and cores",
            limit_value=evaluations * ticks / (steps_per_second() * cores()),
        )
    }


def checked(place: Path) -> dict[str, Any]:
    """Development cases of the blind check in one mode; the limit is their processor time over all cores."""
    cases = ("--cases", str(CHECK_CASES), "--seed", "1", "--development")
    words = ("gap", "check", *cases, "--modes", "days", "--no-angle")
    before = _children_s()
    seconds = timed(place, *words, "-o", "check")
    busy = (_children_s() - before) / (os.cpu_count() or 1)
    scale = WHOLE_CHECK / CHECK_CASES
    return {
        f"gap check, {WHOLE_CHECK} cases": figure(
            seconds * scale,
            "s",
            goal=480.0,
            limit="its processor time over all cores",
            limit_value=busy * scale,
            note=f"{CHECK_CASES} development cases of one mode, six whole rigs, scaled",
        )
    }


def toured(place: Path) -> dict[str, Any]:
    """What `make run` does once installed; the limit is the one sine that keeps real time."""
    from rig.log.reader import read

    seconds = _python(place, "-m", "rig.app.tour", "tour")
    (sine,) = read(place / "tour" / "quick", phases=None)
    return {
        "make run, once installed": figure(
            seconds, "s", goal=25.0, limit="its sine in real time", limit_value=float(sine.t_s[-1])
        )
    }


PARTS: Sequence[Callable[[Path], dict[str, Any]]] = (diagnosed, identified, toured)


def timed(place: Path, *words: str) -> float:
    """Seconds that a pamrig command takes in that folder, as a process of its own."""
    return _python(place, "-m", "rig.cli.main", *words)


def _python(place: Path, *words: str) -> float:
    """Seconds that a process of its own takes in that folder; CalledProcessError when it fails."""
    begun = time.perf_counter()
    subprocess.run([sys.executable, *words], cwd=place, check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - begun


def _children_s() -> float:
    """Processor time of all processes that have been waited for, theirs included."""
    times = os.times()
    return times.children_user + times.children_system
