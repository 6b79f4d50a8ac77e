"""The answer in sentences for somebody at the rig, for the terminal and the page: which questions it answers, in which
order. No number is computed here.

What each effect is called and means on the rig stands in `rig.gap.answer.words.effects`; what may not be said together
in `rig.gap.answer.consistency`.
"""

from rig.gap.answer.facts import Verdict
from rig.gap.answer.result import Diagnosis
from rig.gap.answer.words.causes import cause_sentences, likely_reasons, something_unknown, where_to_look
from rig.gap.answer.words.compared import reference
from rig.gap.answer.words.how_far import how_far_it_closes, what_stays
from rig.gap.answer.words.next_record import what_to_record
from rig.gap.answer.words.nothing_found import nothing_found
from rig.gap.answer.words.observed import of_single_samples, seen_beside
from rig.gap.answer.words.retuning import absorbed, what_retuning_closes
from rig.gap.answer.words.sizes import degrees, percent
from rig.gap.answer.words.stages import where_it_lies
from rig.gap.answer.words.sureness import how_sure, likelier
from rig.gap.reference.kinds import ReferenceKind
from rig.gap.settings import EVEN_CHANCE, LARGE_GAP


def answers(diagnosis: Diagnosis) -> dict[str, str]:
    """Question -> answer: what it is, what doubts all of it, how far, re-tuning, what stays, what to look at; then
    where and how sure."""
    found = diagnosis.verdict is not Verdict.NONE
    of_the_simulator = diagnosis.reference is ReferenceKind.SIMULATOR or absorbed(diagnosis)
    stays = bool(diagnosis.named) or diagnosis.verdict is Verdict.UNKNOWN
    planned = diagnosis.next_experiment
    questions = {
        "Answer:": " ".join(headline(diagnosis)),
        "Doubt:": "; ".join(diagnosis.doubts),
        "Why:": likely_reasons(diagnosis),
        "Look at:": where_to_look(diagnosis),
        "Re-tuning:": what_retuning_closes(diagnosis) if found or of_the_simulator else "",
        "What stays:": what_stays(diagnosis) if stays else "",
        "Also seen:": seen_beside(diagnosis),
        "Compared with:": reference(diagnosis),
        "Where:": where_it_lies(diagnosis) if diagnosis.causes else "",
        "How sure:": how_sure(diagnosis),
        "Model:": _what_the_model_misses(diagnosis),
        "Next:": what_to_record(diagnosis, planned) if planned else "",
    }
    return {question: answer for question, answer in questions.items() if answer}


def headline(diagnosis: Diagnosis) -> list[str]:
    """The first lines: sentences that somebody at the rig understands at once."""
    if diagnosis.verdict is Verdict.NONE:
        sentences = [nothing_found(diagnosis), of_single_samples(diagnosis)]
    elif not diagnosis.named:
        sentences = [something_unknown(diagnosis)]
    else:
        first, *more = cause_sentences(diagnosis)
        sentences = [_as_sure_as_it_is(first, diagnosis), *more, how_far_it_closes(diagnosis)]
    return [text for text in sentences if text]


def _as_sure_as_it_is(sentence: str, diagnosis: Diagnosis) -> str:
    """The first sentence of an answer, behind how little sure it is where a half is more than that."""
    if diagnosis.confidence >= EVEN_CHANCE:
        return sentence
    sure, first = percent(diagnosis.confidence), f"{sentence[:1].lower()}{sentence[1:]}"
    rival = likelier(diagnosis)
    return f"Not sure ({sure}; {rival}): {first}" if rival else f"Likeliest, but not sure ({sure}): {first}"


def _what_the_model_misses(diagnosis: Diagnosis) -> str:
    """That a model misses the earlier days themselves, where it plainly does."""
    misfit = diagnosis.evidence.model_misfit_deg
    if misfit is None or misfit <= LARGE_GAP * diagnosis.gap.floor_deg:
        return ""
    return (
        f"as it stands it misses the earlier days by {degrees(misfit)} deg rms. That is no part of the gap, "
        "which is what changed since. Unless the model was identified on these days, `pamrig identify` on them "
        "makes it smaller."
    )
