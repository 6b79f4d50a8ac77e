"""The simulator with the named causes added: a model like any other, for `pamrig simulate` and the simulated rig."""

from dataclasses import replace

from rig.gap.carry import full_numbers
from rig.gap.nominal import Nominal
from rig.gap.result import Diagnosis
from rig.model.parameters import AddedEffect, Model


def augmented(model: Model, diagnosis: Diagnosis, nominal: Nominal) -> Model:
    """`model` with every cause, those found by their signature included, as an added effect: all its numbers written out, and a
    word on where they come from.
    """
    causes = [cause.applied for cause in diagnosis.causes if cause.applied is not None]
    added = [
        AddedEffect(cause.stage, {name: float(value) for name, value in full_numbers(cause, nominal).items()}) for cause in causes
    ]
    names = ", ".join(cause.effect for cause in causes) or "nothing"
    text = f"{model.provenance.text} With {names} added by pamrig gap diagnose.".strip()
    return replace(model, effects=[*model.effects, *added], provenance=replace(model.provenance, text=text))
