"""A simulator alone: what it lacks with its size, what re-tuning would close, none for a healthy rig."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support.plants.gap_rigs import identified, model, mounted, session

from rig.gap.answer import assemble, kept_effects
from rig.gap.answer.consistency import contradictions
from rig.gap.answer.how_far.held_out import HowFar, how_far
from rig.gap.answer.how_far.retuning import retune
from rig.gap.diagnosis import diagnose_with_grounds
from rig.gap.hypotheses.fit import Fit
from rig.gap.hypotheses.library import LIBRARY, NONE, UNKNOWN
from rig.gap.pipeline import Grounds
from rig.gap.priors import fitted
from rig.gap.records.pairs import pair_up
from rig.model.parameters import AddedEffect, Model, Parameter
from rig.record import Record

LACKING = [
    ("valve_lag", {"tau_s": 0.03}, "tau_s", 0.15),
    ("delay", {"delay_s": 0.06}, "delay_s", 0.1),
    ("pressure_ceiling", {"ceiling_mpa": 0.27}, "ceiling_mpa", 0.05),
]


def alone(*effects: AddedEffect, simulator: Model | None = None) -> tuple[object, Grounds]:
    """The diagnosis of a rig with these effects from its simulator alone."""
    found, grounds = diagnose_with_grounds(simulator or model(), session(71, *effects))
    assert isinstance(grounds, Grounds)
    return found, grounds


@pytest.mark.parametrize(("effect", "numbers", "size", "within"), LACKING)
def test_an_effect_ahead_of_the_monitors_needs_no_healthy_day(
    effect: str, numbers: dict[str, float], size: str, within: float
) -> None:
    found, grounds = alone(AddedEffect(effect, numbers))
    assert [cause.effect for cause in found.causes] == [effect]
    assert found.causes[0].parameters[size].value == pytest.approx(numbers[size], rel=within)
    assert found.gap.after_deg < 0.5 * found.gap.rms_deg
    assert found.gap.after_low_deg <= found.gap.after_deg <= found.gap.after_high_deg
    assert grounds.posteriors[0].names == [effect]


def test_a_healthy_rig_lacks_nothing() -> None:
    found, grounds = alone()
    assert found.verdict == "none"
    assert found.causes == []
    assert all(posterior.probability[NONE] > 0.9 for posterior in grounds.posteriors)


def test_what_explains_nothing_of_records_that_the_fit_has_not_seen_is_not_named(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    bent = AddedEffect("backlash", {"width_deg": 3.0})
    found, _ = alone(bent)
    assert [cause.effect for cause in found.causes] == ["backlash"]

    def worse(causes: Sequence[tuple[str, Fit]], *given: Any) -> HowFar:
        far = how_far(causes, *given)
        return replace(far, after_deg=2.0 * found.gap.rms_deg) if causes else far

    monkeypatch.setattr(assemble, "how_far", worse)
    found, _ = alone(bent)
    assert (found.verdict, [cause.effect for cause in found.causes]) == ("unknown", [UNKNOWN])
    assert max(found.confidence, found.causes[0].confidence) <= 0.5, "play is likelier than that"
    assert any(note.startswith("backlash explains") and "it may act" in note for note in found.notes)
    assert contradictions(found.to_json()) == []


@pytest.mark.parametrize(("share", "named"), [(0.01, False), (0.03, True)])
def test_what_closes_next_to_nothing_of_what_it_was_found_on_is_not_named(
    share: float, named: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(kept_effects, "share_closed", lambda posterior, fit: share)
    found, _ = alone(AddedEffect("backlash", {"width_deg": 3.0}))
    assert [cause.effect for cause in found.causes] == ["backlash" if named else UNKNOWN]
    assert contradictions(found.to_json()) == []


def test_probabilities_of_a_factor_add_up_and_the_set_holds_its_mass() -> None:
    _, grounds = alone(AddedEffect("viscous_friction", {"tau_s": 0.02}))
    for posterior in grounds.posteriors:
        assert sum(posterior.probability.values()) == pytest.approx(1.0)
        assert sum(posterior.probability[name] for name in posterior.names) >= 0.95
        assert sum(posterior.probability[name] for name in posterior.names[:-1]) < 0.95


def test_what_the_library_does_not_hold_is_unknown() -> None:
    records = session(71, AddedEffect("valve_slew", {"fill_mpa_s": 0.25, "exhaust_mpa_s": 0.25}))
    found, grounds = diagnose_with_grounds(model(), records, library=["valve_offset", "sensor_gain"])
    assert found.verdict in ("unknown", "partly_explained")
    assert isinstance(grounds, Grounds)
    assert grounds.posteriors[0].best == UNKNOWN or grounds.posteriors[0].beside > 0.5


def test_retuning_finds_the_parameter_that_moved() -> None:
    rig = model()
    slower = replace(rig.valve.parameters["valve1_tau_s"], value=rig.valve.parameters["valve1_tau_s"].value + 0.02)
    moved = replace(rig, valve=replace(rig.valve, parameters={**rig.valve.parameters, "valve1_tau_s": slower}))
    found = retune(moved, pair_up(session(72), [], rig.p0_mpa).pairs, True)
    assert found is not None
    assert found.retuning.closes_fraction > 0.9
    (tau,) = [one for one in found.retuning.moved if one.name == "valve1_tau_s"]
    assert tau.after == pytest.approx(rig.valve.parameters["valve1_tau_s"].value, rel=0.05)
    assert tau.low <= tau.after <= tau.high


def test_retuning_a_simulator_that_fits_moves_no_time_constant() -> None:
    found = retune(model(), pair_up(session(73), [], model().p0_mpa).pairs, True)
    assert found is not None
    assert [one.name for one in found.retuning.moved if one.name.endswith("tau_s")] == []
    assert found.retuning.after_deg < 2.0 * found.retuning.before_deg


def sister(fill: float = 1.0, exhaust: float = 1.0) -> Model:
    """The simulator of another rig of the build, whose regulators fill and exhaust in so many times the time."""
    rig = model()
    known = rig.valve.parameters
    other = {f"valve{n}_tau_s": replace(tau := known[f"valve{n}_tau_s"], value=fill * tau.value) for n in (1, 2)}
    other |= {f"valve{n}_exhaust_ratio": Parameter(exhaust / fill, "1", 0.1, 10.0) for n in (1, 2)}
    return replace(rig, valve=replace(rig.valve, parameters=known | other))


@pytest.mark.parametrize(("fill", "sure"), [(0.7, False), (1.4, True)])
def test_a_dead_time_beside_a_sister_with_other_regulators_is_that_dead_time(fill: float, sure: bool) -> None:
    """Beside a quicker sister much of it may be a lag as well: then both are said."""
    late = session(75, AddedEffect("delay", {"delay_s": 0.06}))
    found, grounds = diagnose_with_grounds(sister(fill, fill), late, reference="simulator")
    assert isinstance(grounds, Grounds)
    first = found.causes[0]
    assert "delay" in ([first.effect] if sure else [first.effect, *first.ambiguous_with])
    assert grounds.posteriors[0].fits["delay"].sizes[0] == pytest.approx(0.06, rel=0.15)


def test_regulators_that_re_tuning_slows_look_like_a_lag_and_like_nothing_behind_the_monitors() -> None:
    found, _ = diagnose_with_grounds(sister(0.6, 0.6), session(79), reference="simulator")
    assert found.verdict == "none"
    assert found.retuning is not None
    assert {one.name for one in found.retuning.moved[:2]} == {"valve1_tau_s", "valve2_tau_s"}
    assert found.retuning.looks_like[0] == "valve_lag"
    assert all(LIBRARY[name].upstream for name in found.retuning.looks_like)


def test_dry_friction_that_re_tuning_absorbs_looks_like_nothing_ahead_of_the_monitors() -> None:
    rubs = session(79, AddedEffect("coulomb_friction", {"width_deg": 1.0}))
    found, _ = diagnose_with_grounds(sister(), rubs, reference="simulator")
    assert found.retuning is not None
    assert "coulomb_friction" in found.retuning.looks_like
    assert "valve_lag" not in found.retuning.looks_like


def test_each_rig_has_a_zero_of_its_own() -> None:
    """Another rig's simulator that is 2 deg off lacks nothing, and re-tuning says which number moved; the rig's own
    does."""
    found, _ = diagnose_with_grounds(mounted(2.0), session(77), reference="simulator")
    assert found.verdict == "none"
    assert found.retuning is not None
    (zero,) = [one for one in found.retuning.moved if one.name == "sensor_offset_deg"]
    assert (zero.before, zero.after) == (2.0, pytest.approx(0.0, abs=0.3))
    own, _ = diagnose_with_grounds(mounted(2.0), session(77))
    assert own.causes[0].effect == "sensor_offset"


def test_a_lag_is_named_beside_another_zero() -> None:
    late = session(78, AddedEffect("delay", {"delay_s": 0.06}))
    found, _ = diagnose_with_grounds(mounted(-2.0), late, reference="simulator")
    assert [cause.effect for cause in found.causes] == ["delay"]


def test_retuning_finds_that_exhausting_takes_longer() -> None:
    found = retune(sister(1.0, 0.7), pair_up(session(76), [], model().p0_mpa).pairs, True)
    assert found is not None
    (ratio,) = [one for one in found.retuning.moved if one.name == "valve1_exhaust_ratio"]
    assert (ratio.before, ratio.after) == (pytest.approx(0.7), pytest.approx(1.0, abs=0.1))


def test_records_without_pressures_are_judged_on_the_angle_alone() -> None:
    records = [
        replace(record, p1_mpa=None, p2_mpa=None) for record in session(74, AddedEffect("delay", {"delay_s": 0.2}))
    ]
    found, grounds = diagnose_with_grounds(model(), records)
    assert isinstance(grounds, Grounds)
    assert [posterior.problem.name for posterior in grounds.posteriors] == ["angle"]
    assert found.verdict != "none"
    assert np.isfinite(found.gap.after_deg)


OFF_MPA = 0.003


def misreading(record: Record) -> Record:
    """The record as a first monitor that reads too much would have it."""
    assert record.p1_mpa is not None
    return replace(record, p1_mpa=record.p1_mpa + OFF_MPA)


def test_what_a_monitor_misreads_and_what_a_valve_does_are_parted_by_the_angle() -> None:
    """Both look alike to the pressures; only one reaches the joint."""
    day, valve = session(70), AddedEffect("valve_offset", {"offset_mpa": OFF_MPA, "balance": 1.0})
    read, done = (
        diagnose_with_grounds(model(), records, [day])[1]
        for records in ([misreading(record) for record in session(71)], session(71, valve))
    )
    assert isinstance(read, Grounds)
    assert isinstance(done, Grounds)
    assert read.expected.misread is not None
    assert read.expected.misread.offset_mpa[0] == pytest.approx(fitted().levels["session"].monitors * OFF_MPA, rel=0.1)
    assert read.posteriors[1].probability[NONE] > 0.5, "the joint does nothing that needs a cause"
    assert done.posteriors[0].probability["valve_offset"] > 0.5 > read.posteriors[0].probability["valve_offset"]


def test_what_the_angle_says_counts_for_what_lies_ahead() -> None:
    _, grounds = alone()
    ahead = grounds.posteriors[0]
    names = sorted(ahead.probability, key=lambda name: -ahead.probability[name])[:2]
    same, against = (
        ahead.with_evidence(dict.fromkeys(names, 3.0)),
        ahead.with_evidence({names[0]: -60.0, names[1]: 0.0}),
    )
    assert same.probability == pytest.approx(ahead.probability)
    assert against.best == names[1]
    assert sum(against.probability.values()) == pytest.approx(1.0)
    assert ahead.likely(2.0) == names[:1], "at least one"
    assert ahead.likely(0.0) == sorted(ahead.probability, key=lambda name: -ahead.probability[name])


def unsaid(*effects: AddedEffect) -> list[Record]:
    """Records that do not say around which P0 they were commanded."""
    return [replace(record, p1_cmd_mpa=None, p2_cmd_mpa=None, facts={}) for record in session(79, *effects)]


BOTH = [
    (AddedEffect("co_contraction", {"shift_mpa": 0.02}), "shift_mpa", 0.02),
    (AddedEffect("valve_gain", {"gain": -0.1}), "gain", -0.1),
]


@pytest.mark.parametrize("reference", ["simulator", "fingerprint"])
@pytest.mark.parametrize(("effect", "size", "wanted"), BOTH)
def test_what_moves_both_pressures_is_no_other_p0(
    effect: AddedEffect, size: str, wanted: float, reference: str
) -> None:
    found, _ = diagnose_with_grounds(identified(), unsaid(effect), reference=reference)
    assert found.causes[0].effect == effect.effect
    assert found.causes[0].confidence > 0.8
    assert found.causes[0].parameters[size].value == pytest.approx(wanted, rel=0.1)


@pytest.mark.parametrize(("shift_mpa", "said"), [(0.025, False), (0.04, True)])
def test_a_shift_that_may_have_been_commanded_is_said_and_half_as_sure(shift_mpa: float, said: bool) -> None:
    shifted = unsaid(AddedEffect("co_contraction", {"shift_mpa": shift_mpa}))
    found, _ = diagnose_with_grounds(identified(), shifted, reference="fingerprint")
    assert found.causes[0].effect == "co_contraction"
    assert any("around another P0" in note for note in found.notes) is said
    assert (found.causes[0].confidence <= 0.5) is said


def test_what_monitors_misread_from_day_to_day_says_nothing_of_the_angle() -> None:
    """An offset of half a degree is as unlikely beside days whose monitors are off by a kilopascal or so each day."""

    def off(day: list[Record], mpa: float) -> list[Record]:
        return [replace(record, p1_mpa=np.asarray(record.p1_mpa) + mpa) for record in day]

    days = [session(seed) for seed in (1, 2, 3, 4, 5, 6)]
    unlike = [off(day, mpa) for day, mpa in zip(days, (0.0015, -0.001, 0.0005, -0.0015, 0.001, -0.0005), strict=True)]
    seen = []
    for these in (days, unlike):
        _, grounds = diagnose_with_grounds(model(), session(71), these)
        assert isinstance(grounds, Grounds)
        factor = grounds.posteriors[-1].plain.factor
        shifted = factor.lines.of(factor.gap + 0.5)
        seen.append(factor.healthy.chi_square(shifted) - factor.healthy.chi_square(factor.gap_lines))
    assert seen[1] > 0.5 * seen[0]
