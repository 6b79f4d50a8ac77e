"""What is found, in sentences: each named cause with its size, what else is there, what it may as well be; or that
something unknown is. No number is computed here."""

from collections.abc import Sequence

from rig.gap.answer.facts import RAW, Verdict
from rig.gap.answer.observations import MONITORS_ALONE
from rig.gap.answer.result import Cause, Diagnosis
from rig.gap.answer.words.compared import before, from_model, no_effect, than
from rig.gap.answer.words.effects import EffectWords, capital, noun_of
from rig.gap.answer.words.effects_without_valves import words_of
from rig.gap.answer.words.sizes import size
from rig.gap.hypotheses.inverse_problems import ANGLE, PRESSURES
from rig.gap.settings import EVEN_CHANCE, LARGE_GAP

MOST_ALIKE = 4
"""Effects that one sentence lists by name."""


def cause_sentences(diagnosis: Diagnosis) -> list[str]:
    """Each named cause as a sentence, and behind it what it may as well be; behind the last whether that is all."""
    sentences = []
    for cause in diagnosis.named:  # what looks like it stands right behind it: a cause behind that would be meant
        rest = _rest(diagnosis) if cause is diagnosis.named[-1] else ""
        sentences += [f"{_with_size(cause, diagnosis)}{rest}.", _alike(cause)]
    return sentences


def something_unknown(diagnosis: Diagnosis) -> str:
    """That there is something which no effect explains, where it is seen, and what is nearest."""
    alone = next((seen.text for seen in diagnosis.observations if seen.test == MONITORS_ALONE), "")
    if alone:
        return f"{capital(alone)}."
    what = "The rig does something that the simulator does not" if from_model(diagnosis) else "Something has changed"
    near = next((cause.ambiguous_with for cause in diagnosis.causes if cause.ambiguous_with), ())
    likely = [line.effect for line in diagnosis.ranking if line.effect in near and line.probability > EVEN_CHANCE]
    if likely:
        may = f"{noun_of(likely[0])} may do it, but with it the simulator follows these records no better"
        return f"{what}{_seen(diagnosis)}: {may}."
    nearest = (
        f" The nearest, and not near enough, {'is' if len(near) == 1 else 'are'} {_some(near, ' and ')}."
        if near
        else ""
    )
    return f"{what}{_seen(diagnosis)}, and {no_effect(diagnosis)} explains it.{nearest}"


def likely_reasons(diagnosis: Diagnosis) -> str:
    """What usually causes each named effect."""
    return _of_each([(words.noun, words.reasons) for words in _words(diagnosis)])


def where_to_look(diagnosis: Diagnosis) -> str:
    """What to look at on the rig for each named effect."""
    return _of_each([(words.noun, words.look_at) for words in _words(diagnosis)])


def unexplained(diagnosis: Diagnosis) -> str:
    """What something unknown is, as the end of a clause: "that", or "what", ..."""
    return f"{no_effect(diagnosis)} explains" if diagnosis.only else "the library has no name for"


def in_pressures(diagnosis: Diagnosis) -> bool:
    """A cause was told from others by the measured pressures, whatever the angle alone could be taken for."""
    return any(cause.judged_on == PRESSURES for cause in diagnosis.named)


def _words(diagnosis: Diagnosis) -> list[EffectWords]:
    """The named effects in the words of the rig."""
    words = (words_of(cause.effect, diagnosis.channels) for cause in diagnosis.named)
    return [each for each in words if each is not None]


def _of_each(texts: Sequence[tuple[str, str]]) -> str:
    """One text of each effect, (noun, text); of several, behind what it is called."""
    several = len(texts) > 1
    return ". ".join(f"{capital(noun)}: {text}" if several else text for noun, text in texts)


def _with_size(cause: Cause, diagnosis: Diagnosis) -> str:
    """One effect with its size, unit and sign, without a full stop."""
    words = words_of(cause.effect, diagnosis.channels)
    try:
        sentence = "" if words is None else words.sentence(cause.parameters)
    except KeyError:  # a law of another package has numbers of its own
        sentence = ""
    sentence = sentence or _by_its_numbers(cause)
    if "{than}" in sentence:
        return sentence.replace("{than}", than(diagnosis))
    if from_model(diagnosis):
        return f"{sentence}; the simulator does not have that"
    return f"{sentence}; {before(diagnosis, cause)}"


def _by_its_numbers(cause: Cause) -> str:
    """An effect that has no words: its name and what was fitted of it."""
    fitted = [(name, number) for name, number in cause.parameters.items() if number.high > number.low]
    listed = ", ".join(f"{name} {size(number, signed=True)}" for name, number in fitted)
    name = cause.effect.replace("_", " ").capitalize()
    return f"{name} ({listed})" if listed else name


def _rest(diagnosis: Diagnosis) -> str:
    """Whether the named effects are all there is."""
    if diagnosis.verdict is Verdict.PARTLY_EXPLAINED:
        return f"; something else is there too{_seen(diagnosis)}, that {unexplained(diagnosis)}"
    gap = diagnosis.gap
    if gap.after_deg > LARGE_GAP * gap.floor_deg and any(cause.judged_on not in RAW for cause in diagnosis.named):
        return "; the laws follow these records only roughly, and no others do so more closely"
    return "; nothing else is needed to explain these records"


def _seen(diagnosis: Diagnosis) -> str:
    """In which measured quantities something unknown is seen."""
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
