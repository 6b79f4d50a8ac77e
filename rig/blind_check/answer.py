"""Answering: the diagnosis on questions, in a process of its own that can see nothing else.

`answer_cases` starts the process and returns when its answers are written; `main` is what that process does, by the
same package as whoever asked. Nothing of the labels, their seed or the maker's folder is among its arguments, its
environment or the files it may open.
"""

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from rig.blind_check import sandbox
from rig.blind_check.folder import MODEL_FILES, PRIORS_FILE, read_json, whole, write_json
from rig.blind_check.modes import DEFAULT, MODES, Mode
from rig.errors import RecordError, RigError
from rig.parallel import end_with

if TYPE_CHECKING:
    from rig.record import Record

KEPT_ENVIRONMENT: Final = ("PATH", "LANG", "LC_ALL", "LD_LIBRARY_PATH", "TZ")
ONE_THREAD: Final = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
"""Cases run beside each other, so each keeps to one core."""
_BEGINNING: Final = (
    "import sys; sys.path.insert(0, sys.argv[1]); from rig.blind_check.answer import main; "
    "del sys.path[0]; main(sys.argv[2:])"
)
"""The answering process: an isolated interpreter knows neither PYTHONPATH nor the folder that the package came from,
and would answer by whichever is installed."""
DaysRead = dict[tuple[tuple[str, int, int], ...], "Sequence[Record]"]
"""Records of days by their files' names, devices and inodes."""
_FAILURES: Final = (RigError, ValueError, ArithmeticError, LookupError)
"""What a diagnosis may raise on one case without ending the check: that case then counts as wrong."""


def answer_cases(questions: str, answers: str, tokens: Sequence[str]) -> int:
    """Answer these questions, but for those already answered; returns how many were missing. RecordError when the
    process fails."""
    missing = [token for token in tokens if not (Path(answers) / f"{token}.json").exists()]
    if not missing:
        return 0
    questions, answers = str(Path(questions).resolve()), str(Path(answers).resolve())  # the process stands elsewhere
    Path(answers).mkdir(parents=True, exist_ok=True)
    environment = {name: os.environ[name] for name in KEPT_ENVIRONMENT if name in os.environ}
    environment |= dict.fromkeys(ONE_THREAD, "1") | {"NUMBA_CACHE_DIR": str(compiled_beside(Path(answers)))}
    package = Path(__file__).resolve().parents[2]
    call = [sys.executable, "-I", "-B", "-c", _BEGINNING, str(package), str(os.getpid()), questions, answers, *missing]
    ended = subprocess.run(
        call, env=environment, cwd=questions, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False
    )
    if ended.returncode != 0:
        lines = ended.stderr.strip().splitlines() or ["no message"]
        raise RecordError(f"{questions}: the answering process ended with status {ended.returncode}: {lines[-1]}")
    return len(missing)


def compiled_beside(answers: Path) -> Path:
    """The answering processes' own folder of machine code, with a copy of what is compiled already; nobody else runs
    what lies there."""
    from numba.core.caching import UserProvidedCacheLocator

    import rig

    subpath: Any = UserProvidedCacheLocator.get_suitable_cache_subpath
    cache, root = answers / ".compiled", Path(rig.__file__).resolve().parent
    for made in root.rglob("__pycache__/*.nb[ic]"):
        place = cache / str(subpath(str(made.parent.parent / "x.py"))) / made.name
        if not place.exists():
            with whole(place) as copy:
                shutil.copyfile(made, copy)
    return cache


def main(arguments: Sequence[str]) -> None:
    """The answering process: pid of who started it, questions folder, answers folder, tokens."""
    parent, *places = arguments[:3]
    (questions, answers), tokens = (Path(place).resolve() for place in places), arguments[3:]
    layers = sandbox.enter([questions / token for token in tokens], [answers])
    end_with(int(parent))  # after the sandbox: whoever gets another identity loses what he asked of the kernel before
    days_read: DaysRead = {}
    for token in tokens:
        write_json(
            answers / f"{token}.json", answer_question(questions / token, days_read) | {"sandbox_layers": layers}
        )


def answer_question(place: Path, days_read: DaysRead | None) -> dict[str, Any]:
    """The answers of one question, mode by mode: diagnosis as JSON, augmented model, seconds, or the error.
    `days_read`: days that were read for a question before, and are added to."""
    from rig.blind_check.naive import naive_answers
    from rig.log.reader import read

    question_file = place / "question.json"
    question = read_json(question_file) if question_file.exists() else {"modes": list(DEFAULT), "leave_out": []}
    records = read(place / "records")
    found = sorted((place / "baselines").glob("day_*")) if (place / "baselines").is_dir() else []
    days = [_read_once(day, {} if days_read is None else days_read) for day in found]
    modes: dict[str, Any] = {}
    for name in question["modes"]:
        begun, worked = time.perf_counter(), time.process_time()
        experiments = [read(one) for one in sorted((place / "experiments" / name).glob("*"))]
        try:
            answered = diagnosed(place, records, days, MODES[name], question["leave_out"], experiments)
        except _FAILURES as error:
            answered = {"error": f"{type(error).__name__}: {error}"}
        modes[name] = answered | {"seconds": time.perf_counter() - begun, "cpu_seconds": time.process_time() - worked}
    naive = {mode: naive_answers(records, days, place.name, mode == "pressures") for mode in ("pressures", "angle")}
    return {"modes": modes, "naive": naive, "leave_out": question["leave_out"]}


def _read_once(day: Path, days_read: DaysRead) -> "Sequence[Record]":
    """The records of a day; the cases of one rig are given the same files (`link_day`), which need be read once."""
    from rig.log.reader import read

    files = tuple((path.name, path.stat().st_dev, path.stat().st_ino) for path in sorted(day.iterdir()))
    if files not in days_read:
        days_read[files] = read(day)
    return days_read[files]


def diagnosed(
    place: Path,
    records: Sequence[Any],
    days: Sequence[Any],
    mode: Mode,
    leave_out: Sequence[str],
    experiments: Sequence[Any] = (),
) -> dict[str, Any]:
    """The diagnosis in one mode as plain data, and what it adds to the simulator; `experiments` that followed count
    too."""
    from rig.gap.answer.how_far.augment import augmented
    from rig.gap.diagnosis import diagnose_with_grounds
    from rig.gap.hypotheses.library import LIBRARY
    from rig.gap.priors import fitted
    from rig.model.parameters import load_model

    path, priors = place / MODEL_FILES[mode.model], place / PRIORS_FILE
    settings = fitted(priors) if priors.exists() else fitted()
    model, chosen = load_model(path) if path.exists() else None, days[: mode.days]
    library = [name for name in LIBRARY if name not in leave_out] if mode.withheld else None
    reference = "auto" if mode.reference == "sessions" and len(chosen) < 2 else mode.reference
    diagnosis, grounds = diagnose_with_grounds(
        model,
        records,
        chosen,
        pressures=mode.pressures,
        library=library,
        reference=reference,
        experiments=experiments,
        settings=settings,
    )
    if model is None:
        return {"diagnosis": diagnosis.to_json(), "added": []}
    simulator = augmented(model, diagnosis, grounds.expected)
    added = [{"effect": each.effect, "parameters": each.parameters} for each in simulator.effects]
    law = simulator.muscle.parameters.get("mean_exponent")
    return {"diagnosis": diagnosis.to_json(), "added": added, "mean_exponent": None if law is None else law.value}
