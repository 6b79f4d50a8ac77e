"""A hunt's folder: every sweep it ran, its records, what was found after each; so that it goes on after a kill."""

import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from rig.config import finite, read_text
from rig.errors import ConfigError, RigError
from rig.outputs import OutputKind, file_name, make_folder, write_text
from rig.service.connections.socket_access import lock_folder

FILE = "hunt.json"
VERSION = 1
"""Of the form of FILE; a file of another is refused."""
MODEL_TEXT = "model_sha256"
"""Among what was asked: the digest of the model's file, which somebody may write anew between two calls."""

RIG_TEXT = "rig_sha256"
"""Among what was asked: the digest of what the rig measures with and moves; another rig may have the same name."""


@dataclass(frozen=True)
class HuntStep:
    """One sweep of a hunt."""

    sweep: str
    """Its YAML, within the folder."""
    why: str
    minutes: float
    """On the rig."""
    records: str = ""
    """Their folder within the hunt's, once they are whole."""
    set: tuple[tuple[str, float], ...] = ()
    """The names that hold the credible mass after it, with their probabilities."""
    since: int | None = None
    """Given to a daemon, whose newest job until then had this number; None: it was not."""

    @property
    def done(self) -> bool:
        """Recorded."""
        return bool(self.records)

    def to_json(self) -> dict[str, Any]:
        """One entry of `steps`."""
        return asdict(self) | {"set": [list(pair) for pair in self.set]}


@dataclass(frozen=True)
class Hunt:
    """What a hunt did so far."""

    folder: Path
    asked: Mapping[str, Any] = field(default_factory=dict)
    """Rig, model, reference, baselines and what begins it: a hunt goes on with the same only."""
    steps: tuple[HuntStep, ...] = ()
    ended: str = ""

    @property
    def minutes(self) -> float:
        """Of the rig's time, used."""
        return sum(step.minutes for step in self.steps if step.done)

    def with_last(self, step: HuntStep) -> "Hunt":
        """The same, its last step replaced."""
        return replace(self, steps=(*self.steps[:-1], step))

    def require_folder(self) -> None:
        """RigError when its folder was moved or removed since it was saved: made anew it would hold a part of the hunt,
        which nobody could go on with, and the rig would have moved for nothing."""
        if not (self.folder / FILE).is_file():
            raise RigError(f"{self.folder}: moved or removed while the hunt was at work; it is not made anew")

    def save(self) -> None:
        """Keep it, whole or not at all."""
        plain = {
            "version": VERSION,
            "asked": dict(self.asked),
            "steps": [step.to_json() for step in self.steps],
            "ended": self.ended,
        }
        self.folder.mkdir(parents=True, exist_ok=True)
        write_text(self.folder / FILE, json.dumps(plain, indent=1) + "\n", OutputKind.HUNT)


@contextmanager
def alone_in(folder: Path) -> Iterator[None]:
    """The folder, made where it is missing, for one hunt at a time: two would overwrite each other's notes, and neither
    knew all of its records. StateError while another is at work there. One in which nothing came to lie is removed
    again."""
    made = not folder.exists()
    make_folder(folder)
    lock = lock_folder(folder, f"{folder}: another hunt is at work there; wait for its end, or name another folder")
    try:
        yield
    finally:
        if lock is not None:
            os.close(lock)
        if made:
            with suppress(OSError):
                folder.rmdir()


def open_hunt(folder: Path, asked: Mapping[str, Any]) -> Hunt:
    """The hunt of a folder: as it was left, or a new one. ConfigError when the folder's is of something else."""
    place = folder / FILE
    if not place.exists():
        return Hunt(folder, asked)
    text = read_text(place)
    try:
        plain = json.loads(text)
        steps = _one_after_the_other([_step(one) for one in plain["steps"]])
        before = dict(plain["asked"])
    except (ValueError, LookupError, TypeError, OverflowError, RecursionError) as error:
        raise ConfigError(f"{place}: not a hunt's file: {error}") from None
    if plain.get("version") != VERSION:
        raise ConfigError(f"{place}: of version {plain.get('version')}; this pamrig reads version {VERSION}")
    _check_same(folder, before, asked)
    return Hunt(folder, asked, steps, plain.get("ended", ""))


def _check_same(folder: Path, before: Mapping[str, Any], asked: Mapping[str, Any]) -> None:
    """ConfigError when a hunt began with something else, as far as its file says with what."""
    changed = next((key for key, value in asked.items() if key in before and before[key] != value), None)
    if changed in (MODEL_TEXT, RIG_TEXT):
        what = asked["model"] if changed == MODEL_TEXT else f"the rig {asked['rig']}"
        raise ConfigError(f"{folder}: {what} has been changed since this hunt began; name another folder")
    if changed is not None:
        raise ConfigError(
            f"{folder}: holds a hunt with {changed} {before[changed]}, not {asked[changed]}; ask the same, or name "
            "another folder"
        )


def _one_after_the_other(steps: list[HuntStep]) -> tuple[HuntStep, ...]:
    """The steps of a file; ValueError where one before the last has no records, or two have the same: they would count
    as two experiments."""
    if not all(step.done for step in steps[:-1]):
        raise ValueError("a step before the last has no records")
    folders = [step.records for step in steps if step.done]
    if len({*folders}) < len(folders):
        raise ValueError("two steps have the same records")
    return tuple(steps)


def _step(plain: Mapping[str, Any]) -> HuntStep:
    """One entry of the file; ValueError for one that no hunt wrote, such as a place outside its folder."""
    names = tuple((str(name), finite(chance)) for name, chance in plain["set"])
    sweep, records = str(plain["sweep"]), str(plain["records"])
    for name in (sweep, *([records] if records else [])):
        if name != file_name(name):
            raise ValueError(f"{name!a} is no name of a step's file")
    since = None if plain.get("since") is None else int(plain["since"])
    if (minutes := finite(plain["minutes"])) < 0.0:
        raise ValueError(f"a step of {minutes:g} minutes")
    return HuntStep(sweep, str(plain["why"]), minutes, records, names, since)
