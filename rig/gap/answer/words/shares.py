"""What the shares beside an answer are shares of, in a sentence."""

from rig.gap.answer.result import Diagnosis
from rig.gap.answer.words.sizes import percent

BY_CAUSES = "share by causes"
"""Heading of the shares along the chain."""


def shares_along(diagnosis: Diagnosis) -> str:
    """What the table of the chain's stages shares out, and how that differs from what comes through the pressures."""
    text = (
        "A stage's share is what its causes close, each alone in the simulator, of all that the causes close so, in "
        "mean squares of the angle; what none explains counts where it was seen."
    )
    shares = diagnosis.where.shares
    if not shares:
        return text
    through, behind = percent(shares["valve"]), percent(shares["downstream"])
    return (
        f"{text} By the measured pressures, whatever the cause, {through} of the gap come through them and {behind} "
        "from behind them."
    )
