"""The report of a diagnosis: one self-contained HTML page that opens offline, on a phone and in print."""

from importlib.resources import files
from pathlib import Path
from typing import Final

import jinja2

from rig.gap.answer.result import Diagnosis
from rig.gap.answer.words import SOURCES, answers
from rig.gap.days.findings import Findings
from rig.gap.pipeline import Grounds
from rig.model.parameters import Model
from rig.outputs import Kind, write_text
from rig.report.gap_figures import figures

MODES: Final = {
    "valve": [f"p{valve} {mode}" for valve in (1, 2) for mode in ("offset", "gain", "lag")],
    "angle": ["offset", "gain", "lag", "width"],
}
"""Names of the modes in the order of rig.gap.days.floor's columns."""


def write_page(path: Path, diagnosis: Diagnosis, findings: Findings | Grounds, model: Model) -> None:
    """Write the page; RigError when the file cannot be written."""
    write_text(path, page(diagnosis, findings, model), Kind.PAGE)


def page(diagnosis: Diagnosis, findings: Findings | Grounds, model: Model) -> str:
    """The page as text."""
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    template = environment.from_string(files("rig.report").joinpath("gap_page.html.jinja").read_text(encoding="utf-8"))
    return template.render(
        answers={question.rstrip(":"): answer for question, answer in answers(diagnosis).items()},
        diagnosis=diagnosis,
        modes=MODES,
        figures=figures(diagnosis, findings),
        assumed=_assumed(diagnosis, findings, model),
    )


def _assumed(diagnosis: Diagnosis, findings: Findings | Grounds, model: Model) -> list[str]:
    """What the answers rest on."""
    nominal, sessions = findings.prepared.nominal, diagnosis.evidence["sessions"]
    told = [
        f"The healthy rig is {'the mean of ' + str(sessions) + ' baseline sessions' if sessions else 'the model alone'}; the floor comes from {SOURCES[diagnosis.gap['floor_source']]}.",  # noqa: E501
        f"Pressures were {'used: each valve is judged on its own monitor' if diagnosis.evidence['pressures_used'] else 'not used: only the angle was judged'}.",  # noqa: E501
        f"P0 is {nominal.p0_mpa:.3g} MPa; regulators answer in {1e3 * nominal.tau0_s:.0f} ms; the description of muscles and joint misses {nominal.misfit_deg:.2g} deg rms of the baseline and is used in differences only.",  # noqa: E501
        f"The model ({model.muscle.kind}, driven by {model.muscle.input.value}) was not tuned to these records.",
    ]
    return [*told, *diagnosis.notes]
