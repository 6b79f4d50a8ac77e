"""What a question lets through: a thief who guesses labels from all that the answering process sees beside the records
themselves."""

import math
from collections.abc import Callable, Sequence

import numpy as np
import pytest

from hil.reference.cases import Purpose
from hil.reference.source import PhysicsSource
from rig.blind_check.folder import token_of
from rig.blind_check.generate import left_out
from rig.blind_check.modes import DAYS, GROUPS, SISTERS, asked, names_of
from rig.gap.hypotheses.library import LIBRARY, effect_class

CASES = 100
SHEETS = 40


def told(token: str, place: float, missing: Sequence[str], label: dict) -> list[bool]:
    """A question as yes and no: the bits of its name, its place among all names, what is asked, what is left out, how
    many days."""
    bits = [bool(int(token, 16) >> bit & 1) for bit in range(64)]
    places = [place < share for share in (0.1, 0.25, 0.5, 0.75, 0.9)]
    modes = [bool(asked(names_of([group]), label)) for group in GROUPS]
    return [*bits, *places, *modes, *(effect in missing for effect in LIBRARY), label["baselines"] == 3]


def questions(missing_of: Callable[[int, int, dict], Sequence[str]]) -> tuple[np.ndarray, np.ndarray]:
    """(what is told, the number of the true effect) of all single cases."""
    rows, truths = [], []
    source = PhysicsSource(Purpose.SCORING, against=(DAYS, SISTERS))
    for seed in range(SHEETS):
        labels, key = source.sheet(seed, CASES), seed.to_bytes(32, "little")
        tokens = [token_of(key, number) for number in range(CASES)]
        order = {token: rank / CASES for rank, token in enumerate(sorted(tokens))}
        for number, (token, label) in enumerate(zip(tokens, labels, strict=True)):
            if label["kind"] == "single" and label["effects"][0] in LIBRARY:
                rows.append(told(token, order[token], missing_of(seed, number, label), label))
                truths.append(list(LIBRARY).index(label["effects"][0]))
    return np.array(rows), np.array(truths)


def stolen(rows: np.ndarray, truths: np.ndarray) -> float:
    """Share of effects named right by a naive Bayes thief who has seen the opened labels of the first half."""
    half, effects = len(rows) // 2, len(LIBRARY)
    seen = np.array(
        [(rows[:half][truths[:half] == k].sum(0) + 1.0) / ((truths[:half] == k).sum() + 2.0) for k in range(effects)]
    )
    guess = rows[half:] @ np.log(seen).T + ~rows[half:] @ np.log(1.0 - seen).T
    return float(np.mean(guess.argmax(1) == truths[half:]))


def own_class_in_half(seed: int, number: int, label: dict) -> list[str]:
    """A rule that tells: the case's own class is missing in every second question."""
    own = {effect_class(effect, True) for effect in label["effects"] if effect in LIBRARY}
    return (
        [effect for effect in LIBRARY if effect_class(effect, True) in own]
        if number % 2
        else left_out(seed, number)[:1]
    )


@pytest.mark.parametrize("rule", [left_out, own_class_in_half])
def test_the_question_tells_a_thief_nothing(rule: Callable[..., Sequence[str]]) -> None:
    asked = (lambda seed, number, _: left_out(seed, number)) if rule is left_out else rule
    rows, truths = questions(asked)
    chance = 1.0 / len(LIBRARY)
    noise = 4.0 * math.sqrt(chance / (len(rows) / 2))
    score = stolen(rows, truths)
    if rule is left_out:
        assert score < chance + noise
    else:
        assert score > 5.0 * chance, "the thief can tell a rule that tells"
