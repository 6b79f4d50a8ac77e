"""The sentences of an answer: each effect with size, unit and sign, every verdict, what looks alike, re-tuning."""

import re
from collections.abc import Iterator
from dataclasses import replace

import pytest
from support.records.told_answers import cause, told

from rig.channels import Channel, Channels
from rig.excite.signals import Sine
from rig.excite.sweep import Entry, Timing
from rig.gap.answer.facts import (
    RAW_DATA,
    SIGNATURE,
    Link,
    ParameterMove,
    Retuning,
)
from rig.gap.answer.result import Cause, Diagnosis, Interval, Ranked
from rig.gap.answer.words.effects import EFFECT_WORDS
from rig.gap.answer.words.sentences import answers, headline
from rig.gap.answer.words.stages import chain_rows
from rig.gap.hypotheses.library import LIBRARY
from rig.gap.plan.experiment import Experiment
from rig.gap.possible_effects import possible
from rig.model.effect_stages import EFFECT_STAGES

TUNING = Retuning(0.751, 0.13, (ParameterMove("valve1_tau_s", 0.043, 0.0531, 0.0525, 0.0537, "s"),))

MOTOR = Channels(Channel("goal", "rad", (-1.0, 1.0)), Channel("position", "rad", (-1.0, 1.0)))
PNEUMATIC_WORDS = re.compile(r"muscle|hose|valve|\bair\b|regulator|pressure|bladder|pneumatic", re.IGNORECASE)


LAG = cause("valve_lag", tau_s=(0.0102, 0.0097, 0.0107, "s"), balance=(0.0, 0.0, 0.0, "1"))
NOTHING_KNOWN = Cause("unknown", "joint", "angle", None, {}, 0.751, 0.751, 0.0, ("backlash", "creep"), 0.9)


def numbers_of(name: str) -> Iterator[dict[str, Interval]]:
    """Numbers of each law and shape of an effect."""
    for law in LIBRARY[name].laws:
        known = {number.name: number for number in EFFECT_STAGES[law.stage].numbers}
        for shape in law.shapes:
            names = dict.fromkeys([*law.free, *shape, *law.tied])
            yield {one: Interval(shape.get(one, 0.5), 0.4, 0.6, known[one].unit) for one in names}


def test_the_first_lines_are_understood_at_once() -> None:
    assert headline(told(LAG)) == [
        "The regulators answer 10 ms later than the simulator says; nothing else is needed to explain these records.",
        "With that in it the simulator's error falls from 0.75 to 0.08 deg on records that the fit has not seen; "
        "under other sweeps 0.07 to 0.09 deg are likely (90 %).",
    ]


@pytest.mark.parametrize(
    ("effect", "numbers", "reference", "said"),
    [
        ("lost_samples", {"probability": (0.043, 0.03, 0.05, "1")}, "fingerprint", "its file does not say"),
        ("quantisation", {"step_deg": (0.2, 0.2, 0.2, "deg")}, "fingerprint", "that was not so when the model was"),
        ("lost_samples", {"probability": (0.043, 0.03, 0.05, "1")}, "session", "that was not so on the earlier day"),
    ],
)
def test_what_nobody_compared_is_not_called_a_change(
    effect: str, numbers: dict[str, tuple[float, float, float, str]], reference: str, said: str
) -> None:
    """A fingerprint keeps its records without their single samples: of those it knows the noise."""
    made = told(cause(effect, SIGNATURE, **numbers), reference=reference)
    (first, *_) = headline(replace(made, evidence=replace(made.evidence, sessions=1)))
    assert said in first


def test_where_begins_with_what_holds_most_of_the_gap_named_or_not() -> None:
    made = told(LAG, NOTHING_KNOWN, verdict="partly_explained")
    links = (Link("valve", ("valve_lag",), 0.13), Link("muscle", (), 0.0), Link("joint", ("unknown",), 0.87))
    assert answers(replace(made, where=replace(made.where, chain=links)))["Where:"] == "in the joint and in the valves."


def test_a_single_record_is_not_told_as_others_that_the_fit_has_not_seen() -> None:
    made = told(LAG)
    alone = replace(made, evidence=replace(made.evidence, records=made.evidence.records[:1]))
    assert " on the half of the record that the fit has not seen; under other sweeps" in headline(alone)[-1]


@pytest.mark.parametrize(
    ("gap", "falls"),
    [
        (
            {"rms_deg": 1.8, "after_deg": 1.6, "after_low_deg": 1.1, "after_high_deg": 2.3},
            "from 1.8 to 1.6 deg on records that the fit has not seen; under other sweeps 1.1 to",
        ),
        (
            {"rms_deg": 41.0, "after_deg": 24.8, "after_low_deg": 0.0, "after_high_deg": 80.0},
            "from 41 to 25 deg on records that the fit has not seen; under other sweeps 0 to 80 deg",
        ),
        ({"rms_deg": 1.84, "after_deg": 1.79, "after_low_deg": 1.5, "after_high_deg": 2.0}, "1.8 deg, hardly changes"),
    ],
)
def test_what_falls_falls_in_the_digits_that_are_told(gap: dict[str, float], falls: str) -> None:
    assert falls in headline(told(cause("creep", "angle"), **gap))[-1]


@pytest.mark.parametrize(
    ("reference", "than"),
    [
        ("simulator", "than the simulator says"),
        ("fingerprint", "than the simulator says"),
        ("session", "than on the earlier day;"),
        ("sessions", "than on the earlier days;"),
    ],
)
def test_the_reference_says_than_what(reference: str, than: str) -> None:
    assert than in headline(told(LAG, reference=reference))[0]


def test_the_day_that_a_fingerprint_keeps_is_no_simulator() -> None:
    def kept(made: Diagnosis) -> str:
        return answers(replace(made, evidence=replace(made.evidence, sessions=1)))["Answer:"]

    lag = kept(told(LAG, reference="fingerprint"))
    assert "10 ms later than when the model was identified" in lag
    assert "the difference from what the rig answered then falls from" in lag
    for made in (
        told(verdict="none", rms_deg=0.09, reference="fingerprint", floor_source="session"),
        told(verdict="none", rms_deg=0.82, reference="fingerprint", floor_source="session"),
        told(NOTHING_KNOWN, verdict="unknown", after_deg=0.751, reference="fingerprint"),
    ):
        assert "simulator" not in kept(made)


def test_a_negative_size_is_a_word_and_no_minus() -> None:
    quicker = headline(told(cause("valve_lag", tau_s=(-0.012, -0.013, -0.011, "s"))))[0]
    assert quicker.startswith("The regulators answer 12 ms sooner than the simulator says")
    less = headline(told(cause("coulomb_friction", "angle", width_deg=(-0.3, -0.31, -0.29, "deg"))))[0]
    assert less.startswith("Dry friction holds the joint back by 0.30 deg less than")


@pytest.mark.parametrize(
    ("ratio", "times"),
    [((2.0, 1.5, 2.5, "1"), "takes 2 times"), ((50.0, 40.0, 50.0, "1"), "takes at least 50 times")],
)
def test_a_ratio_at_the_end_of_its_law_is_a_bound(ratio: tuple[float, float, float, str], times: str) -> None:
    assert times in headline(told(cause("fill_exhaust_asymmetry", ratio=ratio)))[0]


@pytest.mark.parametrize("name", [*LIBRARY])
def test_every_effect_has_its_sentence_for_every_law(name: str) -> None:
    for numbers in numbers_of(name):
        made = replace(cause(name), parameters=numbers)
        first = headline(told(made))[0]
        assert "{" not in first
        assert first[0].isupper()
        assert name in EFFECT_WORDS
        assert first.count("(") == first.count(")")
        assert not first.lower().startswith(name.replace("_", " ") + " ("), "the fallback was used"


@pytest.mark.parametrize("name", possible(MOTOR, []))
def test_a_rig_without_valves_is_told_nothing_of_muscles_and_hoses(name: str) -> None:
    for numbers in numbers_of(name):
        found = replace(cause(name, "angle"), stage=LIBRARY[name].stage, parameters=numbers)
        made = replace(told(found, verdict="explained"), channels=MOTOR)
        said = [*answers(made).values(), *(stage for stage, _, _ in chain_rows(made))]
        assert not [text for text in said if PNEUMATIC_WORDS.search(text)]


@pytest.mark.parametrize(
    ("mismatch", "balance", "says"),
    [
        (0.06, 0.0, "Muscle 1, against muscle 2, pulls 6.0 % more"),
        (-0.06, 1.0, "Muscle 1 pulls 6.0 % less"),
        (0.06, -1.0, "Muscle 2 pulls 6.0 % less"),
        (-0.06, -1.0, "Muscle 2 pulls 6.0 % more"),
    ],
)
def test_a_mismatch_of_one_muscle_says_which(mismatch: float, balance: float, says: str) -> None:
    numbers = {"mismatch": (mismatch,) * 3 + ("1",), "balance": (balance,) * 3 + ("1",)}
    found = cause("muscle_mismatch", "angle", **numbers)
    assert headline(told(found))[0].startswith(f"{says} than")


def test_an_effect_of_another_package_is_told_by_its_name_and_numbers() -> None:
    first = headline(told(cause("stiction", "angle", force_n=(1.2, 1.1, 1.3, "N"))))[0]
    assert first.startswith("Stiction (force_n 1.2 N); the simulator does not have that")


def test_none_says_what_is_usual() -> None:
    said = answers(told(verdict="none", rms_deg=0.09))["Answer:"]
    assert said == (
        "The simulator says what these records show; it is 0.090 deg off (rms), and 0.10 deg is "
        "what a simulator usually misses of the rig that it was identified on. "
        "A cause that moves the angle by much less than that need not show."
    )
    above = answers(told(verdict="none", rms_deg=0.2, reference="session", floor_source="session"))
    assert "above that is of the kind that may differ anyhow" in above["Answer:"]
    assert "Re-tuning:" not in above


@pytest.mark.parametrize(("probability", "dropped"), [(0.99, True), (0.3, False)])
def test_a_likely_effect_with_which_the_simulator_is_no_better_is_not_said_to_be_far(
    probability: float, dropped: bool
) -> None:
    play = Ranked("backlash", "joint", "angle", 0.91, probability, 1.0)
    said = answers(replace(told(NOTHING_KNOWN, verdict="unknown", after_deg=0.751), ranking=[play]))["Answer:"]
    assert ("may do it, but with it the simulator follows these records no better" in said) == dropped
    assert ("no effect of the library explains it" in said) != dropped


def test_unknown_says_where_it_is_seen_and_what_is_nearest() -> None:
    said = answers(told(NOTHING_KNOWN, verdict="unknown", after_deg=0.751))
    assert "seen in the angle, and no effect of the library explains it" in said["Answer:"]
    assert "play (backlash) and creep" in said["Answer:"]
    assert "0.75 deg" in said["What stays:"]


def test_what_stays_of_spoilt_samples_is_no_roughness_of_a_law() -> None:
    spoilt = replace(cause("quantisation", RAW_DATA, step_deg=(7.5, 7.4, 7.6, "deg")), confidence=0.9)
    said = answers(told(spoilt, rms_deg=2.4, after_deg=2.4))["What stays:"]
    assert "in the smoothed angle" in said
    assert "law" not in said


def test_partly_explained_says_that_there_is_more() -> None:
    said = headline(told(LAG, NOTHING_KNOWN, verdict="partly_explained"))
    assert said[0].endswith("something else is there too, seen in the angle, that the library has no name for.")


def test_what_looks_alike_is_said() -> None:
    said = headline(told(replace(LAG, ambiguous_with=("delay",))))
    assert "It may as well be a dead time (delay): these records do not tell them apart." in said


@pytest.mark.parametrize(
    ("alike", "says"),
    [
        (4, "a dead time (delay) or play (backlash) or creep or a leak: these"),
        (5, "a dead time (delay) or play (backlash) or creep or one of 2 others: these"),
    ],
)
def test_of_many_that_look_alike_the_likeliest_are_named_and_the_others_counted(alike: int, says: str) -> None:
    names = ("delay", "backlash", "creep", "leak", "inertia")[:alike]
    assert f"It may as well be {says}" in " ".join(headline(told(replace(LAG, ambiguous_with=names))))


PLAY = cause("backlash", "angle", ("coulomb_friction",), width_deg=(0.8, 0.7, 0.9, "deg"))


def test_of_two_causes_each_has_beside_it_what_looks_like_it() -> None:
    said = headline(told(PLAY, LAG))
    assert said[0].startswith("There are 1.6 deg of play")
    assert said[1].startswith("It may as well be dry friction")
    assert said[2].startswith("The regulators answer 10 ms later")


def test_of_two_causes_reasons_and_remedies_stand_behind_each_ones_name() -> None:
    said = answers(told(PLAY, LAG))
    assert said["Why:"].startswith("Play: a loose coupling")
    assert ". Slower or quicker regulators: later: a low supply" in said["Why:"]
    assert ". Slower or quicker regulators: the supply while" in said["Look at:"]
    assert answers(told(LAG))["Why:"].startswith("later: a low supply")


def test_the_first_line_says_that_it_is_not_sure() -> None:
    said = headline(replace(told(PLAY), confidence=0.26))
    assert said[0].startswith("Likeliest, but not sure (26 %): there are 1.6 deg of play")


def test_nothing_beside_a_model_alone_is_not_told_as_no_fault_at_all() -> None:
    said = answers(told(verdict="none", rms_deg=0.09))["Answer:"]
    assert said.endswith("A cause that moves the angle by much less than that need not show.")
    assert "need not show" not in answers(told(verdict="none", rms_deg=0.09, reference="sessions"))["Answer:"]


@pytest.mark.parametrize(
    ("after", "words"),
    [(0.0804, "the one looks like the other"), (0.4, "closes another 27 %"), (0.01, "the one looks like the other")],
)
def test_retuning_and_what_the_effect_closes_beyond_it(after: float, words: str) -> None:
    said = answers(replace(told(LAG), retuning=replace(TUNING, after_deg=after)))["Re-tuning:"]
    assert "valve 1's time constant goes from 43 ms to 53 ms" in said
    assert words in said


@pytest.mark.parametrize(("reference", "told_of"), [("simulator", True), ("fingerprint", False)])
def test_of_a_simulator_that_lacks_nothing_it_is_told_what_would_move(reference: str, told_of: bool) -> None:
    """Regulators that the pressures show to be slower are news of a simulator also where the angle hardly is."""
    little = replace(TUNING, after_deg=0.7)
    said = answers(replace(told(verdict="none", rms_deg=0.09, reference=reference), retuning=little))
    assert ("valve 1's time constant goes from 43 ms to 53 ms" in said.get("Re-tuning:", "")) == told_of


def test_a_cause_has_no_0_percent_of_a_gap() -> None:
    links = [Link("joint", ("backlash",), 0.998), Link("valve", ("delay",), 0.002), Link("sensor", ("mains_hum",), 0.0)]
    made = told(LAG)
    rows = chain_rows(replace(made, where=replace(made.where, chain=[*links, Link("muscle", (), 0.0)])))
    assert [share for _, share, _ in rows] == ["more than 99 %", "less than 1 %", "none of it", "-"]


def test_a_cause_that_the_pressures_show_looks_like_nothing_behind_them() -> None:
    said = answers(replace(told(LAG), retuning=replace(TUNING, looks_like=("backlash",))))["Re-tuning:"]
    assert "backlash" not in said
    assert "in the angle the one looks like the other" in said


def test_a_cause_does_not_look_like_itself() -> None:
    alike = replace(TUNING, looks_like=("backlash", "creep"))
    said = answers(replace(told(PLAY), retuning=alike))["Re-tuning:"]
    assert "would look the same: creep." in said


def test_a_ceiling_is_told_in_two_digits_however_wide_its_interval() -> None:
    made = told(cause("pressure_ceiling", ceiling_mpa=(0.2594, 0.02, 0.595, "MPa")))
    assert headline(made)[0].startswith("The pressures do not rise above 0.26 MPa")


def test_a_long_list_of_what_looks_the_same_is_cut() -> None:
    many = ("delay", "creep", "backlash", "inertia", "stiffness", "sensor_gain")
    said = answers(replace(told(PLAY), retuning=replace(TUNING, looks_like=many)))["Re-tuning:"]
    assert "a dead time (delay), creep, inertia, another stiffness or loop gain (stiffness) and 1 more." in said
    assert "sensor_gain" not in said


@pytest.mark.parametrize(
    ("separates", "start"),
    [
        (
            ("valve_lag", "delay"),
            "to tell slower or quicker regulators (valve_lag) and a dead time (delay) apart, record",
        ),
        (
            ("backlash", "creep"),
            "play (backlash) and creep leave these records alike; to tell them apart, record",
        ),
    ],
)
def test_what_comes_next_is_tied_to_what_the_answer_names(separates: tuple[str, ...], start: str) -> None:
    made = told(replace(LAG, ambiguous_with=("delay",)))
    wanted = Experiment((), 0.5, 0.7, 0.9, separates, 4.0)
    assert answers(replace(made, next_experiment=wanted))["Next:"].startswith(start)


def test_the_records_to_come_are_called_in_the_rig_s_own_unit() -> None:
    sine = Entry(Sine(frequency_hz=0.5, amplitude_mpa=0.1), Timing(duration_s=10.0), (0.2,))
    made = replace(told(cause("creep", "angle", ("delay",))), channels=MOTOR)
    made = replace(made, next_experiment=Experiment((sine,), 0.5, 0.7, 0.9, ("creep", "delay"), 4.0))
    assert "record sine_0.5hz_0.5rad in" in answers(made)["Next:"]
    assert made.to_json()["next_experiment"]["why"].startswith("sine_0.5hz_0.5rad in")


def test_retuning_that_closes_nothing_says_so_and_leaves_the_effect_what_it_closes() -> None:
    """The fit to one half may be worse on the other: what the effect closes is no more for that."""
    tuning = Retuning(1.156, 1.228, ())
    lag = told(LAG, reference="fingerprint", rms_deg=0.867, after_deg=0.501)
    said = answers(replace(lag, retuning=tuning))["Re-tuning:"]
    assert "would not bring the error of its parameters alone (without the fingerprint) down, 1.2 deg" in said
    assert said.endswith("Slower or quicker regulators (valve_lag) closes 67 %.")
    said = answers(replace(told(LAG, after_deg=0.75), retuning=replace(TUNING, before_deg=0.751, after_deg=0.76)))
    assert "look the same" not in said["Re-tuning:"]
    assert "not bring its error down" in said["Re-tuning:"]


def test_retuning_that_closes_more_says_that_the_simulator_is_off_as_well() -> None:
    said = answers(replace(told(LAG, after_deg=0.5), retuning=TUNING))["Re-tuning:"]
    assert "closes more than slower or quicker regulators (valve_lag) alone" in said


def test_a_move_that_nobody_can_see_is_not_told() -> None:
    hidden = ParameterMove("valve1_gain", 1.002, 0.999, 0.9985, 0.9995, "1")
    plain = replace(hidden, after=0.9, low=0.89, high=0.91)
    seen = [
        answers(replace(told(LAG), retuning=replace(TUNING, moved=(one,))))["Re-tuning:"] for one in (hidden, plain)
    ]
    assert "goes from" not in seen[0]
    assert "valve 1's gain goes from 100 % to 90 %" in seen[1]


@pytest.mark.parametrize(("after_deg", "rough"), [(0.29, False), (0.31, True)])
def test_a_law_that_leaves_much_is_not_said_to_be_all_that_is_needed(after_deg: float, rough: bool) -> None:
    said = headline(told(LAG, after_deg=after_deg, after_low_deg=after_deg, after_high_deg=after_deg))[0]
    assert ("only roughly" in said) is rough
    assert ("nothing else is needed" in said) is not rough


def test_a_mark_in_the_raw_samples_need_close_nothing() -> None:
    mark = cause("sensor_noise", "signature", std_deg=(0.3, 0.29, 0.31, "deg"))
    assert "nothing else is needed" in headline(told(mark, after_deg=0.751, after_high_deg=0.751))[0]


@pytest.mark.parametrize(("rms_deg", "far"), [(0.29, False), (0.82, True)])
@pytest.mark.parametrize("reference", ["sessions", "fingerprint"])
def test_no_finding_of_a_large_gap_is_not_said_to_be_no_change(rms_deg: float, far: bool, reference: str) -> None:
    (said,) = headline(told(verdict="none", reference=reference, rms_deg=rms_deg, floor_source=reference))
    assert ("no effect of the library is likelier than" in said) is far
    assert ("Nothing has changed" in said or "says what these records show" in said) is not far
