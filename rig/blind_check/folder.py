"""A check on disk: where questions, answers, truths and scores lie, and the one rule that no question says what it is.

    CHECK/sealed.json                      public: hash of the labels, number of cases, modes, format
    CHECK/priors.yaml                      public, where given: levels and priors to answer by (a copy in each question)
    CHECK/questions/TOKEN/question.json    what the answering process is told: modes and, for some, effects to leave out
    CHECK/questions/TOKEN/model.yaml baselines/day_1/*.mcap ... records/*.mcap
    CHECK/answers/TOKEN.json               what it said, mode by mode
    CHECK/maker/labels.sealed key          the maker's; keep them from whoever answers
    CHECK/maker/truths/TOKEN.npz           records that no diagnosis is given, and the sizes of the effects
    CHECK/scores/TOKEN.json                one case, scored
    CHECK/follow_up/1/questions/TOKEN/experiments/MODE/1/*.mcap   with records of what an answer recommended

A token is a number from a keyed hash: it sorts the cases anew and says nothing of their order.
"""

import contextlib
import hashlib
import json
import os
import shutil
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from rig.blind_check.modes import BARE, OWN, SISTER
from rig.blind_check.source import Named, records_of
from rig.config import read_text
from rig.errors import ConfigError, RecordError
from rig.log.convert import write_record

FORMAT: Final = "pamrig blind check 2"
PRIORS_FILE: Final = "priors.yaml"
_MOST_JSON_BYTES: Final = 256 * 1024 * 1024
MODEL_FILES: Final = {OWN: "model.yaml", BARE: "model_bare.yaml", SISTER: "model_sister.yaml"}


@dataclass(frozen=True)
class CheckFolder:
    """The paths of one check."""

    root: Path

    @property
    def sealed(self) -> Path:
        return self.root / "sealed.json"

    @property
    def priors(self) -> Path:
        return self.root / PRIORS_FILE

    @property
    def maker(self) -> Path:
        return self.root / "maker"

    @property
    def questions(self) -> Path:
        return self.root / "questions"

    @property
    def answers(self) -> Path:
        return self.root / "answers"

    def question(self, token: str) -> Path:
        return self.questions / token

    def answer(self, token: str) -> Path:
        return self.answers / f"{token}.json"

    def truth(self, token: str) -> Path:
        return self.maker / "truths" / f"{token}.npz"

    def score(self, token: str) -> Path:
        return self.root / "scores" / f"{token}.json"

    def follow_up(self, number: int) -> "CheckFolder":
        """The round after the first question in which recommended experiments were carried out, counted from 1."""
        return CheckFolder(self.root / "follow_up" / str(number))


def token_of(key: bytes, number: int) -> str:
    """The name of case `number`."""
    return hashlib.blake2b(number.to_bytes(8, "little"), key=key, digest_size=8).hexdigest()


@contextlib.contextmanager
def whole(path: Path) -> Iterator[Path]:
    """A place beside `path` that takes its name when it is written, so that a killed process leaves no half answer;
    RecordError, and nothing there, when the disk refuses."""
    part = path.with_name(f"{path.stem}.{os.getpid()}.part{path.suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield part
        part.replace(path)
    except OSError as error:
        raise RecordError(f"{path}: cannot be written: {error.strerror or error}") from None
    finally:
        with contextlib.suppress(OSError):
            part.unlink()


def write_json(path: Path, data: Any) -> None:
    """A whole JSON file, or none."""
    with whole(path) as part:
        part.write_text(json.dumps(data, indent=1, sort_keys=True, default=_plain) + "\n", encoding="utf-8")


def _plain(value: Any) -> Any:
    """numpy's numbers and arrays as Python's."""
    return value.tolist()


def read_json(path: Path) -> Any:
    """The JSON at `path`; RecordError when it is missing, broken, or no plain file of its own: an answering process
    could leave a pipe there, which never ends, or a link to what it may not read itself."""
    if path.is_symlink():
        raise RecordError(f"{path}: is a link, not an answer")
    try:
        return json.loads(read_text(path, _MOST_JSON_BYTES))
    except ConfigError as error:
        raise RecordError(str(error)) from None
    except (ValueError, RecursionError):
        raise RecordError(f"{path}: is not JSON") from None


def require_answers(folder: CheckFolder, tokens: Iterable[str]) -> None:
    """RecordError, with what to do, when one of these questions has no answer."""
    for token in tokens:
        if not os.path.lexists(path := folder.answer(token)):
            raise RecordError(f"{path}: no answer to {token!r}; run `pamrig gap check answer {folder.root}` first")


def write_day(named: Named, folder: Path) -> None:
    """One day's records as MCAP. Every file says the same of itself: nothing but its excitation's name."""
    folder.mkdir(parents=True, exist_ok=True)
    for record in records_of(named):
        path = folder / f"{record.name}.mcap"
        path.unlink(missing_ok=True)
        write_record(record, path, {"program": FORMAT})


def link_day(source: Path, target: Path) -> None:
    """The same day's files in another question, without a copy where the file system can."""
    target.mkdir(parents=True, exist_ok=True)
    for path in sorted(source.glob("*.mcap")):
        place = target / path.name
        place.unlink(missing_ok=True)
        try:
            os.link(path, place)
        except OSError:
            shutil.copyfile(path, place)


def without_times(question: Path) -> None:
    """The same time on everything in a question: when it was written is nobody's business."""
    for path in (question, *question.rglob("*")):
        os.utime(path, (0, 0))


def write_truth(path: Path, facts: Mapping[str, Any], untouched: Named, healthy: Sequence[Named]) -> None:
    """What only the scorer gets: the facts, untouched records with the effect, and the same on healthy days."""
    days = {"case": untouched} | {f"day_{number}": day for number, day in enumerate(healthy)}
    arrays = {
        f"{day}|{name}|{column}": values
        for day, named in days.items()
        for name, columns in named.items()
        for column, values in columns.items()
    }
    with whole(path) as part:
        np.savez_compressed(part, facts=np.array(json.dumps(facts)), **dict[str, Any](arrays))


def read_truth(path: Path) -> tuple[dict[str, Any], Named, list[Named]]:
    """(facts, untouched records with the effect, healthy days), as written."""
    days: dict[str, dict[str, dict[str, Any]]] = {}
    try:
        with np.load(path, allow_pickle=False) as data:
            facts = json.loads(str(data["facts"]))
            for key in data.files:
                if key != "facts":
                    day, name, column = key.split("|")
                    days.setdefault(day, {}).setdefault(name, {})[column] = data[key]
    except OSError as error:
        raise RecordError(f"{path}: cannot be read: {error.strerror or 'not a truth file'}") from None
    return facts, days.pop("case", {}), [days[day] for day in sorted(days)]
