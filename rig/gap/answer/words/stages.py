"""At which stages of the chain something was found, in a sentence and as rows of a table."""

from rig.channels import Channels
from rig.gap.answer.chain import NAMES
from rig.gap.answer.facts import Link
from rig.gap.answer.result import Diagnosis, Interval
from rig.gap.answer.words.sizes import degrees, percent, size
from rig.gap.hypotheses.inverse_problems import PRESSURES
from rig.gap.possible_effects import VALVES
from rig.gap.settings import EVEN_CHANCE

LIES_IN = {
    "timing": "in the timing",
    "valve": "in the valves",
    "muscle": "in the muscles",
    "actuator": "in the actuator",
    "joint": "in the joint",
    "sensor": "in the angle sensor or its converter",
}


def where_it_lies(diagnosis: Diagnosis) -> str:
    """The stages at which something was found, the one with the largest share of the gap first."""
    links = sorted((link for link in diagnosis.where.chain if link.effects), key=lambda link: -link.share)
    text = " and ".join(LIES_IN[stage_name(link.stage, diagnosis.channels)] for link in links)
    doubt = ", if the answer is right" if diagnosis.confidence < EVEN_CHANCE else ""
    return f"{text or 'somewhere in the chain'}{doubt}{_pressures(diagnosis)}."


def chain_rows(diagnosis: Diagnosis) -> list[tuple[str, str, str]]:
    """(stage, share of what the causes close, what was found there) of every stage, for a table."""
    links = diagnosis.where.chain if diagnosis.causes else []
    if not diagnosis.channels.has_valves:
        links = [link for link in links if link.stage != VALVES]
    names = [stage_name(link.stage, diagnosis.channels) for link in links]
    found = [(_share(link), ", ".join(link.effects) or "nothing") for link in links]
    return [(NAMES.get(name, name), *cells) for name, cells in zip(names, found, strict=True)]


def stage_name(stage: str, channels: Channels) -> str:
    """A stage of the chain as its rig has it: muscles only where there are valves that fill them."""
    return "actuator" if stage == "muscle" and not channels.has_valves else stage


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


def _share(link: Link) -> str:
    """The share of the gap of a stage; what was found in the raw samples alone has none of it."""
    if link.effects:
        return percent(link.share) if link.share > 0.0 else "none of it"
    return f"{100.0 * link.share:.0f} %" if link.share >= 0.005 else "-"
