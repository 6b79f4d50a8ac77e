"""What a diagnosis leaves beside its answer: the overview of a campaign, and a word where no next experiment is
known."""

from dataclasses import replace
from pathlib import Path

import pytest

from rig.app.gap.baselines import EarlierDay
from rig.app.gap.diagnosis_files import without_next, write_overview
from rig.app.gap.diagnosis_options import DiagnosisOptions
from rig.gap.answer.facts import Evidence, Gap, Judged, Verdict, Where
from rig.gap.answer.result import Cause, Diagnosis
from rig.gap.plan.experiment import Experiment
from rig.gap.reference.kinds import ReferenceKind


def diagnosis(effect: str | None = None, next_experiment: Experiment | None = None) -> Diagnosis:
    """An answer with one cause or none."""
    causes = [] if effect is None else [Cause(effect, "valve", "valve", None, {}, 1.5, 0.25, 0.97, (), 0.9)]
    gap = Gap(1.5, 0.3, 5.0, 0.97, 0.25, 0.2, 0.3, "sessions", 1.5)
    verdict = Verdict.NONE if effect is None else Verdict.EXPLAINED
    return Diagnosis(verdict, 0.9, gap, Where(None), causes, [], next_experiment)


def options(tmp_path: Path) -> DiagnosisOptions:
    """A page and a next experiment asked for."""
    return DiagnosisOptions(Path("m.yaml"), (), html_to=tmp_path / "gap.html", next_to=tmp_path / "next.yaml")


def test_a_campaign_has_an_overview_that_leads_to_each_day(tmp_path: Path) -> None:
    results = {"day 1": diagnosis("valve_lag"), "<b>2": diagnosis()}
    write_overview(options(tmp_path), results, [EarlierDay(Path("healthy/a"), [])])
    page = (tmp_path / "gap.html").read_text()
    assert page.startswith("<!doctype html>")
    assert '<a href="gap_day%201.html">day 1</a>' in page
    assert "valve_lag" in page
    assert ">0.25<" in page
    assert "Compared with healthy/a." in page
    assert "<b>2" not in page


def test_one_case_has_no_overview(tmp_path: Path) -> None:
    write_overview(options(tmp_path), {None: diagnosis("valve_lag")}, [])
    assert not (tmp_path / "gap.html").exists()


@pytest.mark.parametrize(
    ("reference", "names", "said", "days"),
    [
        (
            ReferenceKind.SIMULATOR,
            ("delay", "valve_lag"),
            "would tell a dead time (delay) and slower or quicker regulators",
            True,
        ),
        (
            ReferenceKind.SESSIONS,
            ("delay", "valve_lag"),
            "would tell a dead time (delay) and slower or quicker regulators",
            False,
        ),
        (ReferenceKind.SIMULATOR, ("delay", "unknown"), "no effects that a sweep would tell apart", False),
    ],
)
def test_why_there_is_no_next_experiment_and_what_would_make_one_possible(
    tmp_path: Path, reference: ReferenceKind, names: tuple[str, ...], said: str, days: bool
) -> None:
    seen = Evidence({"pressures": Judged(0.1, 0.01, "MPa", True, {}, names, 0.0, {})})
    (line,) = without_next(options(tmp_path), {None: replace(diagnosis("delay"), evidence=seen, reference=reference)})
    assert said in line
    assert ("several earlier days (each with --baseline DAY) may make one possible" in line) is days


@pytest.mark.parametrize("old", [False, True])
def test_without_a_next_experiment_it_is_said(tmp_path: Path, old: bool) -> None:
    if old:
        (tmp_path / "next.yaml").write_text("records: []\n")
    (said,) = without_next(options(tmp_path), {None: diagnosis()})
    assert said.startswith("no next experiment: ")
    assert ("from before" in said) is old
    wanted = Experiment((), 0.5, 0.7, 0.9, ("delay", "valve_lag"), 4.0)
    assert list(without_next(options(tmp_path), {None: diagnosis(next_experiment=wanted)})) == []
    (day,) = without_next(options(tmp_path), {"d1": diagnosis()})
    assert "for d1" in day
    assert "next_d1.yaml" in day
