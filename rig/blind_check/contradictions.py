"""Answers that contradict themselves: what no diagnosis may say, whatever the truth is. Reads the diagnosis' JSON
alone."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

SAME: Final = 0.02
"""Explained fractions that are nearer than this are equal."""
SURE: Final = 0.5
"""A confidence from which on an answer is stated rather than considered."""
WITHDRAWN: Final = ("do not use", "cannot be trusted", "is wrong")
"""Words of a note that take an answer back."""
_ANGLE: Final = "angle"
"""What a cause is judged on when it is no other measure than the gap itself."""


def contradictions(said: Mapping[str, Any]) -> list[str]:
    """Each way in which a diagnosis contradicts itself, as a sentence; none for a sound one."""
    named = [cause for cause in said["causes"] if cause["effect"] != "unknown"]
    rules = (_closes_nothing, _explained_but_no_better, _below_the_floor, _order, _taken_back)
    return [sentence for rule in rules for sentence in rule(said, named)]


def _closes_nothing(said: Mapping[str, Any], named: Sequence[Mapping[str, Any]]) -> list[str]:
    return [f"{cause['effect']} is named and explains nothing" for cause in named if cause["explained_fraction"] <= 0.0]


def _explained_but_no_better(said: Mapping[str, Any], named: Sequence[Mapping[str, Any]]) -> list[str]:
    before, after = said["gap"]["rms_deg"], said["gap"].get("after_deg")
    on_the_angle = [cause for cause in named if cause.get("judged_on", _ANGLE) == _ANGLE]
    worse = after is not None and after >= before and bool(on_the_angle)
    return ["explained, and the simulator gets no better"] if said["verdict"] == "explained" and worse else []


def _below_the_floor(said: Mapping[str, Any], named: Sequence[Mapping[str, Any]]) -> list[str]:
    elsewhere = [cause for cause in said["causes"] if cause.get("judged_on", _ANGLE) != _ANGLE]
    below = said["gap"]["ratio"] < 1.0 and said["verdict"] != "none" and not elsewhere
    return [f"{said['verdict']}, with a gap below the floor and nothing else that stands out"] if below else []


def _order(said: Mapping[str, Any], named: Sequence[Mapping[str, Any]]) -> list[str]:
    shares = [cause["explained_fraction"] for cause in named]
    behind = bool(shares) and shares[0] < max(shares) - SAME
    return [f"{named[0]['effect']} stands first and explains less than another"] if behind else []


def _taken_back(said: Mapping[str, Any], named: Sequence[Mapping[str, Any]]) -> list[str]:
    taken = [note for note in said.get("notes", []) if any(words in note.lower() for words in WITHDRAWN)]
    stated = bool(named) and max(float(cause.get("confidence", 0.0)) for cause in named) >= SURE
    return ["a confidence is stated that a note takes back"] if taken and stated else []
