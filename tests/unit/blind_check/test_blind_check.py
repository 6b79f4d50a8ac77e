"""The whole blind check in small: sealed, fixed seeds, honest lower bounds, resumed after a kill, its three steps
apart.

The seeds here are used by this test alone; the figures of the full check are in docs/reference/blind_check_results.md.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from support.plants.narrowed import Narrowed
from support.records.short_session import short_session

from hil.reference.cases import Purpose
from hil.reference.source import PhysicsSource
from rig.app.gap.blind_checking import seal
from rig.blind_check import generate
from rig.blind_check.check import make_answer_score, result_of, result_of_all, score_unit
from rig.blind_check.folder import CheckFolder, read_json, read_truth, write_json
from rig.blind_check.generate import draw, make_unit, open_labels, units
from rig.blind_check.modes import measures_of, names_of
from rig.blind_check.user_labels import score_own
from rig.cli.gap.check import check
from rig.errors import ConfigError, RecordError
from rig.gap.hypotheses.library import LIBRARY
from rig.gap.priors import PRIORS
from rig.log.reader import read
from rig.report.check_page import write_page

SEED = 31
CASES = 8


SOURCE = PhysicsSource(Purpose.SCORING, known=tuple(LIBRARY), session=short_session())


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> CheckFolder:
    """One unit, all steps, records kept."""
    folder = CheckFolder(tmp_path_factory.mktemp("check"))
    source = SOURCE
    draw(source, folder.root, SEED, CASES)
    for unit in units(source, folder):
        make_answer_score(unit, keep=True, rounds=0)
    return folder


@pytest.fixture(scope="module")
def result(finished: CheckFolder) -> dict[str, Any]:
    return result_of(finished)


def test_the_small_check_holds_its_lower_bounds(result: dict[str, Any]) -> None:
    assert result["kinds"] == {"foreign": 1, "none": 2, "pair": 1, "single": 4}
    assert "audit" in result["sandbox_layers"]
    for mode in ("pressures", "angle"):
        figures = result["modes"][mode]
        assert figures["errors"]["k"] == 0
        assert figures["false_alarms"]["k"] <= 1
        assert figures["detected"]["k"] >= figures["detected"]["n"] - 1
    named = result["modes"]["pressures"]["class_first"]
    assert named["k"] >= named["n"] - 1
    assert result["naive"]["always_none"]["pressures"]["detected"]["k"] == 0


def test_the_hash_is_that_of_the_opened_labels(finished: CheckFolder, result: dict[str, Any]) -> None:
    labels, seed = open_labels(finished)
    assert seed == SEED
    assert len(labels) == CASES
    assert result["sealed_sha256"] == read_json(finished.sealed)["sealed_sha256"]


def test_questions_carry_no_trace_of_the_label(finished: CheckFolder) -> None:
    """Names, order, metadata and shape of the records are the same for every case of a unit, whatever its effect."""
    labels, _ = open_labels(finished)
    seen = set()
    for token in labels:
        place = finished.question(token)
        records = read(place / "records")
        facts = [{key: value for key, value in record.facts.items() if key != "sha256"} for record in records]
        shapes = [(record.name, len(record), sorted(record.columns())) for record in records]
        names = sorted(str(path.relative_to(place)) for path in place.rglob("*") if "baselines" not in path.parts)
        told = read_json(place / "question.json")
        assert {path.stat().st_mtime_ns for path in (place, *place.rglob("*"))} == {0}, (
            "when it was written says something"
        )
        assert set(told) == {"modes", "leave_out"}
        seen.add(json.dumps([facts, shapes, names], default=str).replace(token, "TOKEN"))
    assert len(seen) == 1
    words = {effect for label in labels.values() for effect in label["effects"]}
    for path in finished.questions.rglob("*.mcap"):
        if "records" in path.parts:
            text = path.read_bytes()
            assert not [word for word in words if word.encode() in text], path


def test_a_killed_check_goes_on_where_it_was(finished: CheckFolder, result: dict[str, Any]) -> None:
    labels, _ = open_labels(finished)
    lost = sorted(labels)[0]
    kept = {token: finished.score(token).stat().st_mtime_ns for token in labels if token != lost}
    finished.score(lost).unlink()
    with pytest.raises(RecordError, match="1 of 8 cases are not scored"):
        result_of(finished)
    for unit in units(SOURCE, finished):
        make_answer_score(unit, keep=True, rounds=0)
    assert {token: finished.score(token).stat().st_mtime_ns for token in kept} == kept, "nothing was done twice"
    again = result_of(finished)
    assert json.dumps(again, sort_keys=True) == json.dumps(result, sort_keys=True)


def test_another_check_in_the_same_folder_is_refused(finished: CheckFolder) -> None:
    with pytest.raises(RecordError, match="holds another check"):
        draw(SOURCE, finished.root, SEED + 1, CASES)


def test_half_an_answer_is_no_answer(finished: CheckFolder) -> None:
    labels, _ = open_labels(finished)
    for token in labels:
        rows = read_json(finished.score(token))["rows"]
        assert {"pressures", "angle"} <= set(rows)
    assert not list(finished.root.rglob("*.part*"))


def test_a_folder_may_be_named_from_where_one_stands(finished: CheckFolder, monkeypatch: pytest.MonkeyPatch) -> None:
    labels, _ = open_labels(finished)
    answer = finished.answer(next(token for token, label in labels.items() if label["kind"] == "none"))
    was = answer.read_bytes()
    answer.unlink()
    monkeypatch.chdir(finished.root.parent)
    done = CliRunner().invoke(check, ["answer", finished.root.name, "--workers", "1"], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    assert answer.exists()
    answer.write_bytes(was)  # the seconds that it took are in the scores, and other tests compare those


def test_truths_lie_with_the_maker(finished: CheckFolder) -> None:
    labels, _ = open_labels(finished)
    token = next(token for token, label in labels.items() if label["kind"] == "single")
    facts, untouched, healthy = read_truth(finished.truth(token))
    assert list(facts["effects"]) == labels[token]["effects"]
    names = {record.name for record in read(finished.question(token) / "records")}
    assert not names & set(untouched)
    assert len(healthy) == 3
    assert all(np.isfinite(columns["angle_deg"]).all() for columns in untouched.values())


def test_three_steps_and_the_page_from_the_command_line(finished: CheckFolder, tmp_path: Path) -> None:
    runner = CliRunner()
    page = tmp_path / "page.html"
    done = runner.invoke(
        check, ["score", str(finished.root), "--workers", "1", "--html", str(page), "--json", str(tmp_path / "r.json")]
    )
    assert done.exit_code == 0, done.output
    written = json.loads((tmp_path / "r.json").read_text())
    assert set(written["modes"]["pressures"]) >= {
        "false_alarms",
        "detected",
        "stage",
        "class_first",
        "exact_first",
        "truth_in_set",
        "set_size",
    }
    text = page.read_text()
    assert "<svg" in text
    assert "http-equiv" not in text
    assert 'src="http' not in text
    assert "exact name first" in text


def test_own_records_are_scored_by_own_labels(finished: CheckFolder, tmp_path: Path) -> None:
    labels, _ = open_labels(finished)
    own = {token: [{"effect": effect} for effect in label["effects"]] for token, label in labels.items()}
    path = tmp_path / "labels.json"
    path.write_text(json.dumps(own))
    done = CliRunner().invoke(
        check, ["score", str(finished.root), "--labels", str(path), "--json", "-", "--html", str(tmp_path / "p.html")]
    )
    assert done.exit_code == 0, done.output
    assert '"cases": 8' in done.stdout
    path.write_text(json.dumps({"nowhere": []}))
    refused = CliRunner().invoke(check, ["score", str(finished.root), "--labels", str(path)])
    assert isinstance(refused.exception, RecordError)
    assert "no answer to 'nowhere'" in str(refused.exception)


def test_own_labels_are_scored_in_whatever_way_it_was_asked(finished: CheckFolder, tmp_path: Path) -> None:
    """Of a check without the mode `pressures` the score was a KeyError."""
    answer = read_json(next(iter(sorted(finished.answers.glob("*.json")))))
    place, labels = CheckFolder(tmp_path), tmp_path / "labels.json"
    write_json(place.answer("mine"), answer | {"modes": {"fingerprint": answer["modes"]["pressures"]}})
    labels.write_text(json.dumps({"mine": []}))
    assert list(score_own(place, labels)["modes"]) == ["fingerprint"]
    for ratio in ("much", -1.0, [3.0]):
        labels.write_text(json.dumps({"mine": [{"effect": "backlash", "ratio": ratio}]}))
        with pytest.raises(RecordError, match="mine: ratio: expected a number"):
            score_own(place, labels)


def test_a_score_before_the_answers_says_what_is_to_be_done(tmp_path: Path) -> None:
    """It was a file that is no such file, nor a folder."""
    draw(SOURCE, tmp_path, SEED, CASES)
    refused = CliRunner().invoke(check, ["score", str(tmp_path), "--workers", "1"])
    assert isinstance(refused.exception, RecordError)
    assert f"run `pamrig gap check answer {tmp_path}` first" in str(refused.exception)


def test_a_check_is_answered_by_the_levels_that_it_was_begun_with(tmp_path: Path) -> None:
    """Other ones were passed over without a word, or answered the questions that were still to be made."""
    mine, other = (tmp_path / f"{name}.yaml" for name in ("mine", "other"))
    for file in (mine, other):
        file.write_text(f"{PRIORS.read_text()}# {file.name}\n")
    by_mine, by_shipped = (CheckFolder(tmp_path / name) for name in ("by_mine", "by_shipped"))
    hashes = [seal(SOURCE, by_mine, 4, 7, ("days",), priors=given) for given in (mine, mine, None)]
    assert len(set(hashes)) == 1
    assert by_mine.priors.read_bytes() == mine.read_bytes()
    seal(SOURCE, by_shipped, 4, 7, ("days",))
    for folder, by in ((by_mine, "other levels"), (by_shipped, "the shipped levels")):
        with pytest.raises(ConfigError, match=f"holds a check that is answered by {by}"):
            seal(SOURCE, folder, 4, 7, ("days",), priors=other)
    assert not by_shipped.priors.exists()


def test_a_question_that_is_written_is_not_made_again(finished: CheckFolder, tmp_path: Path) -> None:
    unit = units(SOURCE, finished)[0]
    answer = finished.answer(unit.tokens[0])
    aside = answer.rename(tmp_path / "aside.json")
    assert make_unit(unit) == []
    aside.rename(answer)


def test_an_unfinished_check_is_counted_when_asked(finished: CheckFolder, tmp_path: Path) -> None:
    score = next(iter(sorted(finished.root.glob("scores/*.json"))))
    aside = score.rename(tmp_path / "aside.json")
    with pytest.raises(RecordError, match="1 of 8 cases are not scored"):
        result_of_all([finished])
    part = result_of_all([finished], unfinished=True)["parts"][0]
    aside.rename(score)
    assert (part["scored"], part["cases"]) == (CASES - 1, CASES)


def test_several_checks_are_counted_as_one_and_none_twice(
    finished: CheckFolder, result: dict[str, Any], tmp_path: Path
) -> None:
    page, out = tmp_path / "results.md", tmp_path / "merged.json"
    done = CliRunner().invoke(check, ["merge", str(finished.root), "--html", str(page), "--json", str(out)])
    assert done.exit_code == 0, done.output
    merged = json.loads(out.read_text())
    assert merged["modes"]["pressures"]["exact_first"] == result["modes"]["pressures"]["exact_first"]
    (part,) = merged["parts"]
    assert (part["sealed_sha256"], part["seed"]) == (result["sealed_sha256"], SEED)
    assert (part["cases"], part["scored"]) == (CASES, CASES)
    text = page.read_text()
    assert text.startswith("# Results of the blind check\n")
    assert result["sealed_sha256"] in text
    assert "there is none on which nothing was fitted" in text
    again = CliRunner().invoke(check, ["merge", str(finished.root), str(finished.root)])
    assert isinstance(again.exception, RecordError)
    assert "the same labels are there twice" in str(again.exception)


def test_nothing_is_made_for_answered_cases(finished: CheckFolder, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(generate, "write_models", lambda *_: pytest.fail("a finished unit was made again"))
    unit = units(SOURCE, finished)[0]
    assert make_unit(unit) == []
    assert score_unit(unit) == CASES


def checked(source: PhysicsSource, folder: Path, cases: int, groups: tuple[str, ...]) -> dict[str, Any]:
    """Sealed, answered, scored."""
    place = CheckFolder(folder)
    draw(source, folder, SEED, cases, names_of(groups))
    for unit in units(source, place):
        make_answer_score(unit, rounds=0)
    return result_of(place)


@pytest.fixture(scope="module")
def one_day(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Another family, asked beside one day."""
    source = PhysicsSource(Purpose.SCORING, ("fluidic",), known=tuple(LIBRARY), session=short_session())
    return checked(source, tmp_path_factory.mktemp("one_day"), 2, ("one_day",))


@pytest.fixture(scope="module")
def without_days(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """The ways of asking that need none; that they are answered is looked at, and not with what, so its rigs can have
    effects of the sensor only."""
    groups, stages = ("fingerprint", "simulator"), ("sensor",)
    source = Narrowed(
        Purpose.SCORING, ("fluidic",), measures_of(groups), tuple(LIBRARY), short_session(), stages=stages
    )
    return checked(source, tmp_path_factory.mktemp("without_days"), 4, groups)


def test_every_way_of_asking_is_answered_and_scored(one_day: dict[str, Any], without_days: dict[str, Any]) -> None:
    modes = one_day["modes"] | without_days["modes"]
    assert set(modes) == {*names_of(("one_day", "fingerprint", "simulator"))}
    assert set(one_day["families"]) == set(without_days["families"]) == {"fluidic"}
    for name, figures in modes.items():
        assert figures["errors"]["k"] == 0, name
        assert figures["detected"]["n"] + figures["false_alarms"]["n"] > 0, name
    for name in ("one_day", "one_day_angle"):
        assert modes[name]["false_alarms"]["k"] <= 1, f"{name}: rates are the whole check's matter"
        assert modes[name]["detected"]["k"] == modes[name]["detected"]["n"], name
        assert modes[name]["contradictions"]["k"] == 0, name


def test_a_page_shows_every_way_of_asking(without_days: dict[str, Any], tmp_path: Path) -> None:
    write_page(without_days, tmp_path / "page.html")
    write_page(without_days, tmp_path / "page.md")
    assert "sister&#39;s simulator" in (tmp_path / "page.html").read_text()
    text = (tmp_path / "page.md").read_text()
    assert "| family fluidic |" in text
    assert "there is none on which nothing was fitted" in text
