"""Each number that decides is found, moved alone and everywhere, and put back."""

from dataclasses import replace
from pathlib import Path

import pytest

from rig.app.gap.study import sensitivity
from rig.app.gap.study.sensitivity import (
    ComparedAnswer,
    DecidingNumber,
    DevelopmentCases,
    Moved,
    deciding,
    moved_priors,
    numbers,
)
from rig.app.gap.study.sensitivity_page import as_markdown
from rig.gap import settings
from rig.gap.answer.facts import Verdict
from rig.gap.priors import fitted
from rig.gap.reference import expectation

TOP = DecidingNumber(sensitivity.CONSTANTS, "TOP_HZ", settings.TOP_HZ)


def test_every_constant_and_every_fitted_number_is_there_once() -> None:
    shown = [(one.where, one.shown) for one in numbers()]
    assert len(set(shown)) == len(shown)
    assert {"TOP_HZ", "WIDTH_SHARES[0]", "WIDTH_SHARES[1]", "odds.none", "angle.lag_s", "pressures.floor"} <= {
        name for _, name in shown
    }


def test_a_constant_is_moved_where_it_is_read_and_put_back(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = []
    monkeypatch.setattr(sensitivity, "cases_of", lambda asked: (None,))
    monkeypatch.setattr(sensitivity, "answer_to", lambda case, way, known: seen.append(expectation.TOP_HZ))
    before = expectation.TOP_HZ
    sensitivity.answered(DevelopmentCases(("pleated",), 1, 1), TOP, 2.0)
    assert seen == [2.0 * before]
    assert expectation.TOP_HZ == settings.TOP_HZ == before


def test_a_level_is_moved_in_every_reference_and_nothing_else() -> None:
    known = fitted()
    moved = moved_priors(known, DecidingNumber(sensitivity.PRIORS, "angle.lag_s", 0.0), 2.0)
    for name, levels in known.levels.items():
        assert moved.levels[name].angle.patterns["lag_s"] == 2.0 * levels.angle.patterns["lag_s"]
        assert moved.levels[name].pressures == levels.pressures
    assert moved.prior == known.prior
    one = moved_priors(known, DecidingNumber(sensitivity.PRIORS, "prior.degrees", 0.0), 0.5)
    assert one == replace(known, prior=replace(known.prior, degrees=0.5 * known.prior.degrees))


def test_what_is_usual_of_a_simulator_is_moved_effect_by_effect() -> None:
    known = fitted()
    moved = moved_priors(known, DecidingNumber(sensitivity.PRIORS, "usual.inertia", 0.0), 0.5)
    usual = {name: levels.usual.scales for name, levels in known.levels.items() if levels.usual is not None}
    assert usual.keys() == {"simulator", "sister"}
    assert {name: levels.usual.scales for name, levels in moved.levels.items() if levels.usual is not None} == {
        name: {**scales, "inertia": 0.5 * scales["inertia"]} for name, scales in usual.items()
    }


def test_numbers_under_names_in_capitals_are_counted(tmp_path: Path) -> None:
    text = '"""A file."""\nA = 1.0\nB, C = 2, 3.5\nD: float = 4\nE = {"x": (5, 6)}\nlow = 7\nF = True\n'
    (tmp_path / "some.py").write_text(text, encoding="utf-8")
    assert deciding(tmp_path) == {"some.py": (4, 6)}


def test_the_table_begins_with_what_moves_most() -> None:
    quiet = replace(TOP, name="ENVELOPE_HZ")
    moved = [Moved(quiet, factor, 0, 0, 3) for factor in sensitivity.FACTORS]
    moved += [Moved(TOP, factor, 1, 2, 1) for factor in sensitivity.FACTORS]
    base = [ComparedAnswer(Verdict.NONE, (), True)] * 3 + [ComparedAnswer(Verdict.UNKNOWN, (), False)]
    page = as_markdown(DevelopmentCases(("pleated",), 1, 4), base, moved, {"some.py": (4, 6)})
    assert "3 of 4 answers are right" in page
    assert page.index("| `TOP_HZ` | 6 | 1, 2, 1 | 1, 2, 1 |") < page.index("| `ENVELOPE_HZ` |")
