"""The report of a diagnosis: one self-contained HTML page that opens offline, on a phone and in print."""

from collections.abc import Mapping
from pathlib import Path

from rig.gap.answer.result import Diagnosis
from rig.gap.answer.words.compared import SOURCES, from_model
from rig.gap.answer.words.notes import folded
from rig.gap.answer.words.sentences import answers
from rig.gap.answer.words.shares import BY_CAUSES, shares_along
from rig.gap.answer.words.sizes import percent
from rig.gap.answer.words.stages import chain_rows, stage_name
from rig.gap.pipeline import Grounds
from rig.gap.reference.kinds import ReferenceKind
from rig.identify.provenance import tuned_to
from rig.model.parameters import Model
from rig.outputs import OutputKind, write_text
from rig.own_units import own_text
from rig.report.gap_figures import figures
from rig.report.templates import rendered, template


def write_page(
    path: Path,
    diagnosis: Diagnosis,
    grounds: Grounds,
    model: Model,
    origin: Mapping[str, str] | None = None,
) -> None:
    """Write the page, with whose it is (`origin`: rig, dates, files, command); RigError where that fails."""
    write_text(path, page(diagnosis, grounds, model, origin), OutputKind.PAGE)


def page(diagnosis: Diagnosis, grounds: Grounds, model: Model, origin: Mapping[str, str] | None = None) -> str:
    """The page as text."""
    by_question = {question.rstrip(":"): answer for question, answer in answers(diagnosis).items()}
    text = rendered(
        template("gap_page.html.jinja"),
        title="What does the simulator lack?" if from_model(diagnosis) else "What has changed on the rig?",
        headline=by_question.pop("Answer"),
        answers=by_question,
        origin=origin or {},
        diagnosis=diagnosis,
        percent=percent,
        stage_name=stage_name,
        chain=chain_rows(diagnosis),
        by_causes=BY_CAUSES,
        shares=shares_along(diagnosis),
        figures=figures(diagnosis, grounds),
        assumed=_assumed(diagnosis, grounds, model),
    )
    return own_text(text, diagnosis.channels)


def _assumed(diagnosis: Diagnosis, grounds: Grounds, model: Model) -> list[str]:
    """What the answers rest on."""
    nominal, sessions = grounds.expected.response, diagnosis.evidence.sessions
    used, valves = diagnosis.evidence.pressures_used, diagnosis.channels.has_valves
    records = [pair.raw for pair in grounds.expected.pairs]
    description = "The description"
    if valves:
        description = (
            f"P0 is {nominal.p0_mpa:.3g} MPa; regulators answer in {1e3 * nominal.tau0_s:.0f} ms; the description of "
            "muscles and joint"
        )
    lines = [
        f"What is expected is {_expected(diagnosis.reference, sessions)}; "
        f"what is usual comes from {SOURCES[diagnosis.gap.floor_source]}.",
        *([f"Pressures were {'used: each valve is judged by its monitor' if used else 'not used'}."] if valves else []),
        f"{description} misses {nominal.misfit_deg:.2g} deg rms of what is expected and is used in differences only.",
        f"The model ({model.muscle.kind}, driven by {model.muscle.input.value}) {tuned_to(model, records)}.",
    ]
    return [*lines, *folded(diagnosis.notes)]


def _expected(reference: ReferenceKind, sessions: int) -> str:
    if not sessions:
        return "what the model says"
    if reference is ReferenceKind.FINGERPRINT:
        return "what the rig answered to the same sweeps when the model was identified"
    return f"the mean of {sessions} earlier days"
