"""Recommended experiments in the blind check: what is asked again and of what, what the answering process may see, how
the rounds are counted, and two checks of the same cases beside each other."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.plants.narrowed import Narrowed
from support.records.short_session import short_session

from hil.reference.cases import Purpose
from hil.reference.source import PhysicsSource
from rig.app.gap.blind_checking import source_of
from rig.blind_check.answer import answer_cases
from rig.blind_check.check import score_unit
from rig.blind_check.experiments import figures_by_experiments
from rig.blind_check.folder import CheckFolder, read_json, write_json
from rig.blind_check.follow_up import carry_out, recommended
from rig.blind_check.generate import draw, make_unit, open_labels, units
from rig.blind_check.modes import names_of
from rig.blind_check.paired import compared
from rig.blind_check.row import CaseKind, Round, Row, Scored
from rig.errors import RecordError
from rig.log.reader import read
from rig.report.check_pairs import pairs_page

SWEEP = "p0_mpa: 0.2\nduration_s: 5.0\nrecords:\n  - sine: {frequency_hz: 4.0, amplitude_mpa: 0.05}\n"
WANTED = {"config": SWEEP, "separates": ["delay", "valve_lag"], "minutes": 0.2, "expected_confidence": 0.9}


def recommending(folder: CheckFolder, token: str, wanted: Any, mode: str = "fingerprint") -> None:
    """The answer of one case as if it recommended that."""
    answer = read_json(folder.answer(token))
    answer["modes"][mode]["diagnosis"]["next_experiment"] = wanted
    write_json(folder.answer(token), answer)


@pytest.fixture(scope="module")
def followed_up(tmp_path_factory: pytest.TempPathFactory) -> CheckFolder:
    """Two cases of one unit, one of which asks for an experiment, and then for another; what is answered is not looked
    at, so the rigs can be late and nothing else."""
    folder = CheckFolder(tmp_path_factory.mktemp("experiments"))
    known = ("delay", "valve_lag")
    source = Narrowed(Purpose.DEVELOPMENT, ("mckibben",), known=known, session=short_session(), stages=("timing",))
    draw(source, folder.root, 91, 2, names_of(("one_day", "fingerprint"), angle=False))
    (unit,) = units(source, folder)
    make_unit(unit)
    answer_cases(str(folder.questions), str(folder.answers), unit.tokens)
    first, other = unit.tokens
    recommending(folder, first, WANTED)
    recommending(folder, first, None, "one_day")
    for mode in ("fingerprint", "one_day"):
        recommending(folder, other, None, mode)
    labels = dict(zip(unit.tokens, unit.labels, strict=True))
    carry_out(source, folder, labels, 1)
    recommending(folder.follow_up(1), first, WANTED)
    carry_out(source, folder, labels, 2)
    score_unit(unit)
    return folder


def asked_again(folder: CheckFolder) -> str:
    (answer,) = folder.follow_up(1).answers.glob("*.json")
    return answer.stem


def test_only_the_case_and_the_mode_that_asked_are_asked_again(followed_up: CheckFolder) -> None:
    token = asked_again(followed_up)
    for number in (1, 2):
        assert set(read_json(followed_up.follow_up(number).answer(token))["modes"]) == {"fingerprint"}
    assert not (followed_up.root / "follow_up" / "3").exists()


def test_the_second_question_holds_the_first_experiment_too_and_no_word_of_the_label(followed_up: CheckFolder) -> None:
    token = asked_again(followed_up)
    first, second = (followed_up.follow_up(number).question(token) / "experiments" / "fingerprint" for number in (1, 2))
    (one,) = read(first / "1")
    again, other = read(second / "1")[0], read(second / "2")[0]
    assert np.array_equal(one.angle_deg, again.angle_deg)
    assert not np.array_equal(one.angle_deg, other.angle_deg), "noise of its own"
    assert np.array_equal(one.dp_cmd_mpa, other.dp_cmd_mpa)
    labels, _ = open_labels(followed_up)
    words = {effect.encode() for label in labels.values() for effect in label["effects"]}
    place = followed_up.follow_up(2).question(token)
    assert not [path for path in place.rglob("*") if path.is_file() and any(w in path.read_bytes() for w in words)]
    assert {path.stat().st_mtime_ns for path in place.rglob("*")} == {0}
    assert {path.name for path in place.iterdir()} <= {"records", "baselines", "experiments", "question.json"} | {
        path.name for path in place.glob("model*.yaml")
    }


def test_no_earlier_day_holds_the_experiment(followed_up: CheckFolder) -> None:
    token = asked_again(followed_up)
    first, again = followed_up.question(token), followed_up.follow_up(1).question(token)
    for part in ("records", "baselines"):
        names = {str(path.relative_to(place)) for place in (first, again) for path in (place / part).rglob("*.mcap")}
        assert names == {str(path.relative_to(first)) for path in (first / part).rglob("*.mcap")}


def test_every_round_is_scored_with_what_it_promised(followed_up: CheckFolder) -> None:
    row = read_json(followed_up.score(asked_again(followed_up)))["rows"]["fingerprint"]
    assert [one["minutes"] for one in row["rounds"]] == [0.2, 0.2]
    assert row["rounds"][0]["separates"] == ["delay", "valve_lag"]
    assert {"exact", "verdict"} & set(row["rounds"][0])
    other = next(path for path in followed_up.root.glob("scores/*.json") if path.stem != asked_again(followed_up))
    assert json.loads(other.read_text())["rows"]["fingerprint"]["rounds"] == []


def test_what_cannot_be_read_is_no_recommendation() -> None:
    def answer(config: object) -> dict[str, Any]:
        return {"modes": {"one_day": {"diagnosis": {"next_experiment": {"config": config}}}}}

    assert set(recommended(answer(SWEEP))["one_day"]) == {"sine_4hz_0.05mpa"}
    assert recommended(answer("records: [sine\n")) == {}
    assert recommended(answer("/nowhere.yaml")) == {}
    assert recommended({"modes": {"one_day": {"error": "no"}}}) == {}
    assert recommended({"modes": {"withheld": answer(SWEEP)["modes"]["one_day"]}}) == {}


def row(names: list[str], truth: str = "delay", rounds: tuple[Round, ...] = ()) -> Row:
    right = {"exact": names[:1] == [truth], "in_set": truth in names}
    return Row(CaseKind.SINGLE, (truth,), 5.0, names=tuple(names), detected=True, **right, rounds=rounds)


def later(names: list[str], parted: bool | None) -> Round:
    return Round(row(names), 0.5, 0.9, parted=parted)


def test_a_case_that_asked_for_nothing_keeps_its_answer() -> None:
    tie = row(["valve_lag", "delay"], rounds=(later(["delay", "valve_lag"], False), later(["delay"], True)))
    found = figures_by_experiments([row(["delay"]), tie])
    assert [stage["exact_first"]["k"] for stage in found["rounds"]] == [1, 2, 2]
    assert [stage["ties"]["k"] for stage in found["rounds"]] == [1, 1, 0]
    assert [stage["set_size"] for stage in found["rounds"]] == [1.5, 1.5, 1.0]
    assert found["exact_after_two"]["k"] == found["exact_after_two"]["n"] == 2
    assert (found["parted"]["k"], found["parted"]["n"]) == (1, 2)
    assert found["experiments"]["minutes_most"] == 1.0


def test_without_experiments_there_is_one_stage() -> None:
    found = figures_by_experiments([row(["delay"])])
    assert len(found["rounds"]) == 1
    assert found["experiments"]["asked"]["k"] == 0
    assert figures_by_experiments([])["experiments"]["minutes"] is None


def scored(root: Path, seed: int, rights: list[bool]) -> CheckFolder:
    """A check of some single effects of which those are right."""
    folder = CheckFolder(root)
    draw(PhysicsSource(Purpose.DEVELOPMENT, known=("delay", "valve_lag", "backlash")), root, seed, len(rights))
    labels, _ = open_labels(folder)
    for token, label in labels.items():
        said = row(["delay"] if rights[label["number"]] else ["valve_lag"])
        write_json(folder.score(token), Scored({"one_day": said}, {}, []).to_json())
    return folder


def test_two_checks_of_the_same_cases_are_compared_case_by_case(tmp_path: Path) -> None:
    first = scored(tmp_path / "a", 5, [True, True, False, True])
    other = scored(tmp_path / "b", 5, [False, True, True, False])
    found = compared(first, other)
    figure = found.modes["one_day"]["exact name first"]
    assert (figure.first.k, figure.other.k) == (3, 2)
    assert (figure.only_first, figure.only_other) == (2, 1)
    assert found.to_json()["modes"]["one_day"]["exact name first"]["p_value"] == pytest.approx(1.0)
    assert "| one day | exact name first | 75.0 %" in pairs_page(found)


def test_checks_of_other_cases_are_not_compared(tmp_path: Path) -> None:
    with pytest.raises(RecordError, match="other cases"):
        compared(scored(tmp_path / "a", 5, [True] * 4), scored(tmp_path / "b", 6, [True] * 4))


def test_a_session_of_one_s_own_is_recorded_on_every_day(tmp_path: Path) -> None:
    (tmp_path / "own.yaml").write_text(SWEEP)
    source, drawn = source_of(True, ("mckibben",), ("one_day",), tmp_path / "own.yaml"), source_of(True, ("mckibben",))
    (label, *_) = source.sheet(3, 1)
    bench, case = source.bench(label), source.case(label)
    assert [set(day) for day in (*bench.baselines, case.records, bench.sister)] == [{"sine_4hz_0.05mpa"}] * 8
    assert bench.p0_mpa == 0.2
    assert case.facts["effects"] == drawn.case(label).facts["effects"]
    draw(source, tmp_path / "check", 3, 1)
    with pytest.raises(RecordError, match="holds another check"):
        draw(drawn, tmp_path / "check", 3, 1)
