"""The hunt: a tie that the next sweep parts, a hunt that is cut short and goes on, what ends it, what it refuses."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from support.plants.begun_hunts import MODEL, without_a_finding
from support.plants.begun_hunts import hunt_options as options

from rig.app import compose
from rig.app.gap.diagnosing import diagnose_case
from rig.app.gap.diagnosis_options import DiagnosisOptions, NamedDay
from rig.app.gap.hunt.folder import FILE, Hunt, HuntStep, open_hunt
from rig.app.gap.hunt.hunting import NAMED, NO_GAP, NO_NAME, TIME, Hunted, hunt
from rig.app.gap.hunt.report import hunt_and_tell
from rig.errors import CheckFailed, ConfigError
from rig.excite.envelope import check_run
from rig.excite.run_plan import expand
from rig.excite.sweep import load_sweep
from rig.gap.hypotheses.library import NONE, UNKNOWN
from rig.log.reader import read

pytestmark = pytest.mark.usefixtures("each_diagnosed_once")


@pytest.fixture(scope="module")
def found(begun_hunt: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A hunt that was stopped before its second sweep, then went on."""
    folder = shutil.copytree(begun_hunt, tmp_path_factory.mktemp("hunt") / "worn")
    hunt_and_tell(options(folder), lambda step: True, lambda step: None, lambda result: None)
    return folder


def test_one_sine_leaves_a_tie_and_the_next_sweep_parts_it(found: Path) -> None:
    told = json.loads((found / FILE).read_text())
    first, second = told["steps"]
    assert [name for name, _ in first["set"]][:2] == ["valve_lag", "delay"]
    assert first["set"][1][1] > 0.3, "a tie"
    assert [name for name, _ in second["set"]] == ["valve_lag"]
    assert second["set"][0][1] >= 0.95
    assert told["ended"] == NAMED
    assert "delay" in second["why"]


def test_what_a_diagnosis_recommends_keeps_to_the_limits_of_the_rig_that_it_is_told(
    found: Path, tmp_path: Path
) -> None:
    text = (
        Path("configs/rigs/simulated_worn.yaml").read_text().replace("../models/simulated.yaml", f"{MODEL.resolve()}")
    )
    (tmp_path / "narrow.yaml").write_text(text.replace("slew_mpa_s: 5.0", "slew_mpa_s: 0.7"))
    limits = compose.load(tmp_path / "narrow.yaml").limits
    asked = DiagnosisOptions(MODEL, (), rig=tmp_path / "narrow.yaml", next_to=tmp_path / "next.yaml")
    diagnose_case(asked, NamedDay(None, (found / "step_1_records",)))
    for plan in expand(load_sweep(tmp_path / "next.yaml"), 5_000_000):
        check_run(plan, limits, 5_000_000)


def test_everything_it_ran_is_kept_and_the_page_tells_the_story(found: Path) -> None:
    assert len(read(found / "step_1_records")) == 1
    assert len(read(found / "step_2_records")) >= 1
    page = (found / "hunt.html").read_text()
    assert "regulators" in page
    assert "step_2.yaml" in page
    assert (found / "report.html").stat().st_size > 1000


def test_a_hunt_that_is_over_says_so_again_and_runs_nothing(found: Path) -> None:
    before = sorted(found.iterdir())
    again = hunt(options(found), allowed=lambda step: pytest.fail("something would have moved"))
    assert again.hunt.ended == NAMED
    assert sorted(found.iterdir()) == before


def test_a_hunt_of_something_else_is_refused(found: Path) -> None:
    with pytest.raises(ConfigError, match="name another folder"):
        hunt(options(found, model=Path("configs/models/paper_table3.yaml")))


def test_the_time_ends_it(left_hunt: Path) -> None:
    ended = hunt(options(without_a_finding(left_hunt), minutes=0.25))
    assert ended.hunt.ended == TIME
    assert len(ended.hunt.steps) == 1
    assert len(ended.hunt.steps[0].set) >= 2


def test_a_first_session_longer_than_the_hunt_may_take_is_refused_before_anything_moves(tmp_path: Path) -> None:
    asked = options(tmp_path / "hurried", minutes=1.0, first=Path("gap"))
    with pytest.raises(ConfigError, match=r"--minutes 1: .*\(gap\) takes 2\.9") as error:
        hunt(asked, allowed=lambda step: pytest.fail("something would have moved"))
    assert "\n" not in str(error.value)
    assert not (tmp_path / "hurried").exists()


def test_no_number_of_minutes_allows_nothing(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="--minutes nan"):
        hunt(options(tmp_path / "none", minutes=float("nan")), allowed=lambda step: pytest.fail("it would have moved"))


@pytest.fixture(scope="module")
def healthy(tmp_path_factory: pytest.TempPathFactory) -> Hunted:
    """A hunt on a rig that has nothing."""
    folder = tmp_path_factory.mktemp("hunt") / "healthy"
    return hunt(options(folder, rig=compose.load(Path("simulated"))))


def test_where_nothing_is_found_nothing_is_said_to_be_named(healthy: Hunted) -> None:
    assert [name for name, _ in healthy.hunt.steps[-1].set] == [NONE]
    assert healthy.hunt.ended == healthy.to_json()["ended"] == NO_GAP


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"every_day": True}, "a hunt with every_day False, not True; ask the same"),
        ({"first": Path("gap")}, "a hunt with sweep quick, not gap; ask the same"),
        ({"reference": "simulator"}, "a hunt with reference auto, not simulator"),
    ],
)
def test_a_hunt_goes_on_as_it_began_only(tmp_path: Path, more: dict[str, object], said: str) -> None:
    begun = hunt(options(tmp_path / "hunt"), allowed=lambda step: False)
    assert [step.done for step in begun.hunt.steps] == [False]
    with pytest.raises(ConfigError, match=said):
        hunt(options(tmp_path / "hunt", **more), allowed=lambda step: pytest.fail("something would have moved"))


def test_a_hunt_does_not_go_on_with_another_model_of_that_name(tmp_path: Path) -> None:
    model = tmp_path / "model.yaml"
    model.write_bytes(MODEL.read_bytes())
    hunt(options(tmp_path / "hunt", model=model), allowed=lambda step: False)
    model.write_text(f"{MODEL.read_text()}# written anew\n")
    with pytest.raises(ConfigError, match=r"model\.yaml has been changed since this hunt began"):
        hunt(options(tmp_path / "hunt", model=model), allowed=lambda step: False)


def test_a_hunt_does_not_go_on_on_another_rig_of_that_name(tmp_path: Path) -> None:
    """What two rigs show together is the fault of neither. Limits may be changed while a hunt waits."""
    text = Path("configs/rigs/simulated_worn.yaml").read_text()
    (tmp_path / "rig.yaml").write_text(text.replace("../models/simulated.yaml", f"{MODEL.resolve()}"))

    def call(said: str, instead: str) -> Hunted:
        place = tmp_path / "rig.yaml"
        place.write_text(place.read_text().replace(said, instead))
        return hunt(options(tmp_path / "hunt", rig=compose.load(place)), allowed=lambda step: False)

    call("", "")
    call("slew_mpa_s: 5.0", "slew_mpa_s: 4.0")
    with pytest.raises(ConfigError, match="the rig simulated_worn has been changed since this hunt began"):
        call("tau_s: 0.01,", "tau_s: 0.0,")


def test_a_hunt_that_begins_with_a_table_finds_it(tmp_path: Path) -> None:
    (tmp_path / "w.csv").write_text("t_s,dp_mpa\n0,0\n1,0.1\n2,0\n")
    sweep = tmp_path / "tables.yaml"
    sweep.write_text("records: [{waveform: {file: w.csv}}]\n")
    hunt(options(tmp_path / "hunt", first=sweep), allowed=lambda step: False)
    (entry,) = load_sweep(tmp_path / "hunt" / "step_1.yaml").entries
    assert entry.timing.duration_s == 2.0


def test_a_hunt_whose_file_is_from_before_goes_on(tmp_path: Path) -> None:
    hunt(options(tmp_path / "hunt"), allowed=lambda step: False)
    place = tmp_path / "hunt" / FILE
    told = json.loads(place.read_text())
    for key in ("every_day", "sweep", "model_sha256", "rig_sha256"):
        del told["asked"][key]
    place.write_text(json.dumps(told))
    assert hunt(options(tmp_path / "hunt"), allowed=lambda step: False).hunt.ended == "not confirmed"
    assert json.loads(place.read_text())["asked"]["sweep"] == "quick"


@pytest.mark.parametrize(
    ("chances", "said"),
    [
        ({NONE: 0.01, UNKNOWN: 0.97, "delay": 0.02}, NO_NAME),
        ({NONE: 0.01, UNKNOWN: 0.02, "delay": 0.97}, NAMED),
        ({NONE: 0.01, UNKNOWN: 0.5, "delay": 0.49}, ""),
    ],
)
def test_something_unknown_is_no_name(healthy: Hunted, chances: dict[str, float], said: str) -> None:
    finding = healthy.finding
    assert finding is not None
    posteriors = tuple(replace(one, probability=chances) for one in finding.grounds.posteriors)
    assert replace(finding, grounds=replace(finding.grounds, posteriors=posteriors)).settled == said


def test_with_an_earlier_day_what_later_sweeps_say_counts_too(tmp_path: Path) -> None:
    from rig.app.runs.sweeping import SweepOptions, run_sweep

    healthy = compose.load(Path("simulated"))
    run_sweep(Path("gap"), healthy, SweepOptions(tmp_path / "day", virtual=True, seed=1)).judge()
    day = read(tmp_path / "day")
    found = hunt(options(tmp_path / "hunt", days=[day], day_names=("day",), first=Path("gap")))
    assert found.hunt.ended == NAMED
    assert found.finding is not None
    assert found.finding.diagnosis.reference == "session"
    assert [name for name, _ in found.hunt.steps[-1].set] == ["valve_lag"]


def test_a_rig_that_faults_loses_nothing_of_what_was_learnt(left_hunt: Path) -> None:
    folder = left_hunt
    rig = options(folder).rig
    broken = replace(rig, limits=replace(rig.limits, angle_deg=(-2.0, 2.0)))
    told: list[object] = []
    with pytest.raises(CheckFailed):
        hunt_and_tell(options(folder, rig=broken), lambda step: True, lambda step: None, told.append)
    assert len(told) == 1
    kept = open_hunt(folder, {})
    assert [step.done for step in kept.steps] == [True, False]
    assert kept.steps[0].set
    assert (folder / "hunt.html").exists()


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"version": 9, "asked": {}, "steps": []}', '{"steps": [{}]}'])
def test_a_file_that_is_no_hunt_s_is_one_line(tmp_path: Path, text: str) -> None:
    (tmp_path / FILE).write_text(text)
    with pytest.raises(ConfigError) as error:
        open_hunt(tmp_path, {})
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    "steps",
    [
        [("a", 1.0), ("a", 1.0)],
        [("", 1.0), ("a", 1.0)],
        [("a", -1e9), ("", 1.0)],
    ],
    ids=["records twice", "one left out", "time given back"],
)
def test_steps_that_no_hunt_makes_are_refused(tmp_path: Path, steps: list[tuple[str, float]]) -> None:
    Hunt(tmp_path, {}, tuple(HuntStep("s.yaml", "why", minutes, records) for records, minutes in steps)).save()
    with pytest.raises(ConfigError, match="not a hunt's file: "):
        open_hunt(tmp_path, {})


def test_a_hunt_comes_back_as_it_was_saved(tmp_path: Path) -> None:
    step = HuntStep("step_1.yaml", "why", 1.5, "step_1_records", (("delay", 0.7), ("valve_lag", 0.3)))
    so_far = Hunt(tmp_path / "new", {"rig": "a"}, (step, HuntStep("step_2.yaml", "more", 0.5)), "time")
    so_far.save()
    assert open_hunt(tmp_path / "new", {"rig": "a"}) == so_far
    assert so_far.minutes == 1.5
