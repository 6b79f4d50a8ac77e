"""The answer in sentences for somebody at the rig, for the terminal and the page. No number is computed here.

What each effect is called and means on the rig stands in `rig.gap.answer.words.on_the_rig`; what may not be said
together in `rig.gap.answer.consistency`.
"""

from collections.abc import Sequence

from rig.channels import Channels
from rig.gap.answer.chain import NAMES
from rig.gap.answer.facts import RAW, Link, Verdict
from rig.gap.answer.observations import STUCK, USUAL
from rig.gap.answer.result import Cause, Diagnosis, Interval, Observation
from rig.gap.answer.words.compared import (
    FEW,
    SOURCES,
    absorbed,
    error,
    from_model,
    moves,
    no_effect,
    nothing,
    reference,
    than,
)
from rig.gap.answer.words.on_any_rig import on_the_rig
from rig.gap.answer.words.on_the_rig import ON_THE_RIG, OnTheRig, noun_of
from rig.gap.answer.words.sizes import degrees, percent, size
from rig.gap.answer.words.sureness import how_sure, likelier
from rig.gap.hypotheses.inverse_problems import ANGLE, PRESSURES
from rig.gap.plan.experiment import Experiment
from rig.gap.possible_effects import VALVES
from rig.gap.raw_tests.signature import MONITOR
from rig.gap.reference.kinds import Kind
from rig.gap.settings import EVEN_CHANCE, FAR

AS_MUCH = 0.05
"""Shares of the error that differ by less than this are told as the same."""
MOST_ALIKE = 4
"""Effects that one sentence lists by name."""
LIES_IN = {
    "timing": "in the timing",
    "valve": "in the valves",
    "muscle": "in the muscles",
    "actuator": "in the actuator",
    "joint": "in the joint",
    "sensor": "in the angle sensor or its converter",
}


def answers(diagnosis: Diagnosis) -> dict[str, str]:
    """Question -> answer: what it is, what doubts all of it, how far, re-tuning, what stays, what to look at; then
    where and how sure."""
    told = {"Answer:": " ".join(headline(diagnosis))}
    told["Doubt:"] = "; ".join(diagnosis.doubts)
    told["Why:"] = _of_each([(one.noun, one.reasons) for one in _known(diagnosis)])
    told["Look at:"] = _of_each([(one.noun, one.look_at) for one in _known(diagnosis)])
    if diagnosis.retuning and (diagnosis.verdict is not Verdict.NONE or absorbed(diagnosis)):
        told["Re-tuning:"] = _retuning(diagnosis)
    if _named(diagnosis) or diagnosis.verdict is Verdict.UNKNOWN:
        told["What stays:"] = _stays(diagnosis)
    seen = diagnosis.observations
    if diagnosis.verdict is Verdict.NONE:  # the answer says these
        seen = [one for one in seen if not (_is_of_samples(one) or one.test.startswith(MONITOR))]
    if seen:
        told["Also seen:"] = "; ".join(_seen_beside(one, diagnosis) + _no_cause(one) for one in seen) + "."
    told["Compared with:"] = reference(diagnosis)
    if diagnosis.causes:
        told["Where:"] = _where(diagnosis)
    told["How sure:"] = how_sure(diagnosis)
    misfit = diagnosis.evidence.model_misfit_deg
    if misfit is not None and misfit > FAR * diagnosis.gap.floor_deg:
        told["Model:"] = (
            f"as it stands it misses the earlier days by {degrees(misfit)} deg rms. That is no part of the gap, "
            "which is what changed since. Unless the model was identified on these days, `pamrig identify` on them "
            "makes it smaller."
        )
    if diagnosis.next_experiment:
        told["Next:"] = _next(diagnosis, diagnosis.next_experiment)
    return {question: answer for question, answer in told.items() if answer}


def headline(diagnosis: Diagnosis) -> list[str]:
    """The first lines: sentences that somebody at the rig understands at once."""
    if diagnosis.verdict is Verdict.NONE:
        found = [_seen_beside(one, diagnosis) for one in diagnosis.observations if _is_of_samples(one)]
        return [nothing(diagnosis), *([f"Single samples show more: {'; '.join(found)}."] if found else [])]
    named = _named(diagnosis)
    if not named:
        return [_unknown(diagnosis)]
    said = []
    for cause in named:  # what looks like it stands right behind it: a cause behind that would be meant
        said += [f"{_sentence(cause, diagnosis)}{_rest(diagnosis) if cause is named[-1] else ''}.", _alike(cause)]
    if diagnosis.confidence < EVEN_CHANCE:
        sure, first = percent(diagnosis.confidence), f"{said[0][:1].lower()}{said[0][1:]}"
        more = likelier(diagnosis)
        said[0] = f"Not sure ({sure}; {more}): {first}" if more else f"Likeliest, but not sure ({sure}): {first}"
    return [text for text in (*said, _how_far(diagnosis)) if text]


def _of_each(told: Sequence[tuple[str, str]]) -> str:
    """What is told of each cause; of several, behind what it is called."""
    named = len(told) > 1
    return ". ".join(f"{noun[:1].upper()}{noun[1:]}: {text}" if named else text for noun, text in told)


def _named(diagnosis: Diagnosis) -> list[Cause]:
    return [cause for cause in diagnosis.causes if cause.is_named]


def _sentence(cause: Cause, diagnosis: Diagnosis) -> str:
    """One effect with its size, unit and sign, without a full stop."""
    known = on_the_rig(cause.effect, diagnosis.channels)
    numbers = cause.parameters
    try:
        said = "" if known is None else known.says(numbers)
    except KeyError:  # a law of another package has numbers of its own
        said = ""
    if not said:
        listed = ", ".join(
            f"{name} {size(number, signed=True)}" for name, number in numbers.items() if number.high > number.low
        )
        said = (
            f"{cause.effect.replace('_', ' ').capitalize()} ({listed})"
            if listed
            else cause.effect.replace("_", " ").capitalize()
        )
    if "{than}" in said:
        return said.replace("{than}", than(diagnosis))
    if from_model(diagnosis):
        return f"{said}; the simulator does not have that"
    return f"{said}; that was not so {than(diagnosis).removeprefix('than ')}"


def _rest(diagnosis: Diagnosis) -> str:
    """Whether the named effects are all there is."""
    if diagnosis.verdict is Verdict.PARTLY_EXPLAINED:
        return f"; something else is there too{_seen(diagnosis)}, that {_lacks(diagnosis)}"
    gap = diagnosis.gap
    if gap.after_deg > FAR * gap.floor_deg and any(cause.judged_on not in RAW for cause in _named(diagnosis)):
        return "; the laws follow these records only roughly, and no others do so more closely"
    return "; nothing else is needed to explain these records"


def _lacks(diagnosis: Diagnosis) -> str:
    return f"{no_effect(diagnosis)} explains" if diagnosis.only else "the library has no name for"


def _seen(diagnosis: Diagnosis) -> str:
    places = dict.fromkeys(_seen_in(cause) for cause in diagnosis.causes if not cause.is_named)
    return f", seen in {' and '.join(places)}" if places else ""


def _seen_in(cause: Cause) -> str:
    return {PRESSURES: "the pressures", ANGLE: "the angle"}.get(cause.judged_on, "the raw angle")


def _alike(cause: Cause) -> str:
    """What these records leave as likely."""
    if not cause.ambiguous_with:
        return ""
    return f"It may as well be {_some(cause.ambiguous_with, ' or ', 'one of ')}: these records do not tell them apart."


def _some(effects: Sequence[str], between: str, of: str = "") -> str:
    """The first of these effects by name and the others counted, for nobody reads a sentence that lists eleven; the
    ranking has them all."""
    names = [noun_of(name) for name in effects]
    if len(names) > MOST_ALIKE:
        names = [*names[: MOST_ALIKE - 1], f"{of}{len(names) - MOST_ALIKE + 1} others"]
    return between.join(names)


def _how_far(diagnosis: Diagnosis) -> str:
    gap = diagnosis.gap
    before, after = gap.rms_deg, gap.after_deg
    with_it = "that" if len(_named(diagnosis)) == 1 else "these"
    if all(cause.is_raw for cause in _named(diagnosis)):
        return (
            f"It lies in the single samples: without it these are {degrees(after)} deg off instead of "
            f"{degrees(before)}; the smoothed angle, {degrees(gap.smoothed_deg)} deg off, is not helped by it."
        )
    left, between = _after(diagnosis) if after < before else (degrees(before), "")
    if left == degrees(before):
        start = "It shows in the pressures;" if _in_pressures(diagnosis) else f"With {with_it} in it"
        return f"{start} {error(diagnosis)} in the angle, {degrees(before)} deg, hardly changes."
    further = f"; under other sweeps {between} deg are likely (90 %)" if between else ""
    return (
        f"With {with_it} in it {error(diagnosis)} falls from {degrees(before)} to {left} deg "
        f"on {_judged_on(diagnosis)} that the fit has not seen{further}."
    )


def _judged_on(diagnosis: Diagnosis) -> str:
    """What a fit is judged on, see `rig.gap.answer.how_far.halves`."""
    return "records" if len(diagnosis.evidence.records) > 1 else "the half of the record"


def _after(diagnosis: Diagnosis) -> tuple[str, str]:
    """What is left, and the ends of its interval where there is one, to the same digit: that of the interval, or of how
    far the gap falls, or of a quarter of what is left."""
    gap = diagnosis.gap
    low, high = gap.after_low_deg, gap.after_high_deg
    if not low < high:
        return degrees(gap.after_deg), ""
    # a digit fewer, and 1.8 would fall to 2, or 25 be told as 20
    width = min(high - low, gap.rms_deg - gap.after_deg, 0.25 * gap.after_deg)
    left, least, most = (degrees(value, width) for value in (gap.after_deg, low, high))
    return left, f"{least} to {most}" if least != most else ""


def _unknown(diagnosis: Diagnosis) -> str:
    what = "The rig does something that the simulator does not" if from_model(diagnosis) else "Something has changed"
    near = next((cause.ambiguous_with for cause in diagnosis.causes if cause.ambiguous_with), ())
    likely = [one.effect for one in diagnosis.ranking if one.effect in near and one.probability > EVEN_CHANCE]
    if likely:
        named = f"{noun_of(likely[0])} may do it, but with it the simulator follows these records no better"
        return f"{what}{_seen(diagnosis)}: {named}."
    nearest = (
        f" The nearest, and not near enough, {'is' if len(near) == 1 else 'are'} {_some(near, ' and ')}."
        if near
        else ""
    )
    return f"{what}{_seen(diagnosis)}, and {no_effect(diagnosis)} explains it.{nearest}"


def _is_of_samples(one: Observation) -> bool:
    """Single samples show it: where nothing else is found, that is a part of the answer, however little of the gap."""
    return one.test == STUCK or (one.effect is not None and one.test != USUAL)


def _seen_beside(one: Observation, diagnosis: Diagnosis) -> str:
    """A finding that is no cause of the gap, without a full stop."""
    known = None if one.effect is None else on_the_rig(one.effect, diagnosis.channels)
    said = one.text if known is None or not one.parameters else known.says(dict(one.parameters))
    if one.test == USUAL:
        said = said.replace("{than}", than(diagnosis))
    elif "{than}" in said:
        said = one.text
    return f"{said[:1].lower()}{said[1:]}"


def _no_cause(one: Observation) -> str:
    """That a finding beside the causes is none, and why."""
    if one.test == USUAL:
        return " (as much of it as simulators usually lack of healthy rigs, and no cause of the gap)"
    return "" if one.effect is None else " (no cause of the gap)"


def _known(diagnosis: Diagnosis) -> list[OnTheRig]:
    """The named effects in the words of the rig."""
    words = (on_the_rig(cause.effect, diagnosis.channels) for cause in _named(diagnosis))
    return [one for one in words if one is not None]


def _retuning(diagnosis: Diagnosis) -> str:
    """What re-tuning the simulator's own parameters closes, which moved, and what the effects close beyond that."""
    tuning = diagnosis.retuning
    assert tuning is not None
    moved = "; ".join(moves(tuning, diagnosis.channels)[:4])
    before, after = degrees(tuning.before_deg), degrees(tuning.after_deg)
    # the gap is measured against the fingerprint, re-tuning against the parameters without it
    described = diagnosis.reference is Kind.FINGERPRINT
    whose = "the error of its parameters alone (without the fingerprint)" if described else "its error"
    if tuning.closes_fraction > 0.0:
        said = f"fitting the simulator's own parameters again would take {whose} from {before} to {after} deg "
        said += f"({percent(tuning.closes_fraction)} of the mean square)"
    else:
        said = f"fitting the simulator's own parameters again would not bring {whose} down, {before} deg"
    said += (
        f": {moved}."
        if moved
        else f"; no {'valve, ' if diagnosis.channels.has_valves else ''}joint or sensor parameter moves plainly."
    )
    others = [name for name in tuning.looks_like if name not in {cause.effect for cause in diagnosis.causes}]
    if absorbed(diagnosis) and others and not _in_pressures(diagnosis):
        said += f" In these records any of these would look the same: {_first_of(others)}."
    return f"{said} {_beyond(diagnosis)}".rstrip() if not diagnosis.reference.by_days and _helps(diagnosis) else said


def _first_of(effects: Sequence[str]) -> str:
    """The first effects of a list by name, and how many more there are."""
    more = f" and {len(effects) - FEW} more" if len(effects) > FEW else ""
    return f"{', '.join(map(noun_of, effects[:FEW]))}{more}"


def _in_pressures(diagnosis: Diagnosis) -> bool:
    """A cause was told from others by the measured pressures, whatever the angle alone could be taken for."""
    return any(cause.judged_on == PRESSURES for cause in _named(diagnosis))


def _helps(diagnosis: Diagnosis) -> bool:
    return bool(_named(diagnosis)) and diagnosis.gap.after_deg < diagnosis.gap.rms_deg


def _beyond(diagnosis: Diagnosis) -> str:
    """What the named effects close that re-tuning does not; empty where neither closes anything."""
    gap, tuning = diagnosis.gap, diagnosis.retuning
    assert tuning is not None
    # shares of the error that each was measured on: a fingerprint's and its parameters' are not the same
    more = 1.0 - (gap.after_deg / max(gap.rms_deg, 1e-12)) ** 2 - tuning.closes_fraction
    alone = len(_named(diagnosis)) == 1
    what, closes = (noun_of(_named(diagnosis)[0].effect), "closes") if alone else ("what is named", "closes together")
    if abs(more) < AS_MUCH:
        if tuning.closes_fraction < AS_MUCH:
            return ""
        where = "the angle" if _in_pressures(diagnosis) else "these records"
        return f"That is as much as {what} {closes}: in {where} the one looks like the other."
    if more < 0.0:
        return f"That closes more than {what} alone: the simulator is also off in what it has."
    return f"Beyond that, {what} {closes} another {100 * more:.0f} %."


def _stays(diagnosis: Diagnosis) -> str:
    """What is left with the named effects in it, and why."""
    gap = diagnosis.gap
    left, usual = gap.after_deg, gap.floor_deg
    usually = f"where {degrees(usual)} deg are {SOURCES[gap.floor_source]}"
    if left <= usual:
        return f"{degrees(left)} deg, no more than the {degrees(usual)} deg that are {SOURCES[gap.floor_source]}."
    if diagnosis.verdict in (Verdict.UNKNOWN, Verdict.PARTLY_EXPLAINED):
        return f"{degrees(left)} deg, {usually}; the rest is what {_lacks(diagnosis)}."
    if all(cause.is_raw for cause in _named(diagnosis)):
        return f"{degrees(left)} deg in the smoothed angle, {usually}; no simulator takes out what those samples leave."
    return (
        f"{degrees(left)} deg, {usually}; the rest is how roughly the law of the effect and the "
        "simulator's own class repeat this rig."
    )


def _where(diagnosis: Diagnosis) -> str:
    """The stages at which something was found, the one with the largest share of the gap first."""
    found = sorted((one for one in diagnosis.where.chain if one.effects), key=lambda one: -one.share)
    text = " and ".join(LIES_IN[stage_name(one.stage, diagnosis.channels)] for one in found)
    doubt = ", if the answer is right" if diagnosis.confidence < EVEN_CHANCE else ""
    return f"{text or 'somewhere in the chain'}{doubt}{_pressures(diagnosis)}."


def _pressures(diagnosis: Diagnosis) -> str:
    """What the pressures show, where the angle by itself would show nothing."""
    factor = diagnosis.evidence.factors.get(PRESSURES)
    gap = diagnosis.gap
    if factor is None or not factor.found or gap.rms_deg > gap.floor_deg:
        return ""
    by = Interval(factor.gap, factor.gap, factor.gap, "MPa")
    return (
        f"; the pressures show it ({size(by)} rms off, in a shape that is not usual), where the angle alone "
        f"({degrees(gap.rms_deg)} deg, {degrees(gap.floor_deg)} deg is usual) would not"
    )


def _next(diagnosis: Diagnosis, experiment: Experiment) -> str:
    """What to record, and what it tells apart; that these are open where the answer has not said so."""
    heard = {name for cause in diagnosis.causes for name in (cause.effect, *cause.ambiguous_with)}
    names = " and ".join(map(noun_of, experiment.separates))
    known = heard.issuperset(experiment.separates)
    start = f"to tell {names} apart" if known else f"{names} leave these records alike; to tell them apart"
    what = experiment.why(diagnosis.channels)
    return f"{start}, record {what}: they differ by {experiment.weakest:.1f} standard deviations there."


def why_no_next(diagnosis: Diagnosis) -> str:
    """Why no sweep is proposed, and what would make one possible."""
    known = [
        [name for name in one.names if name in ON_THE_RIG] for one in diagnosis.evidence.factors.values() if one.found
    ]
    alike = next((names for names in known if len(names) > 1), [])
    if not alike:
        return "these records leave no effects that a sweep would tell apart"
    said = f"no sweep as large as these records is known that would tell {' and '.join(map(noun_of, alike))} apart"
    days = (
        ""
        if diagnosis.reference is Kind.SESSIONS
        else "; several earlier days (each with --baseline DAY) may make one possible"
    )
    return f"{said}{days}"


def chain_rows(diagnosis: Diagnosis) -> list[tuple[str, str, str]]:
    """(stage, share of what the causes close, what was found there) of every stage, for a table."""
    lines = diagnosis.where.chain if diagnosis.causes else []
    if not diagnosis.channels.has_valves:
        lines = [line for line in lines if line.stage != VALVES]
    called = [stage_name(line.stage, diagnosis.channels) for line in lines]
    found = [(_share(line), ", ".join(line.effects) or "nothing") for line in lines]
    return [(NAMES.get(name, name), *one) for name, one in zip(called, found, strict=True)]


def stage_name(stage: str, channels: Channels) -> str:
    """A stage of the chain as its rig has it: muscles only where there are valves that fill them."""
    return "actuator" if stage == "muscle" and not channels.has_valves else stage


def _share(line: Link) -> str:
    """The share of the gap of a stage; what was found in the raw samples alone has none of it."""
    if line.effects:
        return percent(line.share) if line.share > 0.0 else "none of it"
    return f"{100.0 * line.share:.0f} %" if line.share >= 0.005 else "-"
