"""Whether a model's fingerprint can be used: of a known version, and the numbers of neither changed since."""

import hashlib
import json
from dataclasses import asdict

from rig.model.fingerprint import FORMER, READ, VERSION, Fingerprint
from rig.model.parameters import Model

LACKS = {1: ("corrections", "day"), 2: ("day",)}
"""Version -> what it does not have."""


def fingerprint_checksum(fingerprint: Fingerprint, model: Model) -> str:
    """Over every number of the fingerprint and of the model it stands beside; opens with letters, since 3e47 would be
    read as a number."""
    stages = {
        slot: [stage.kind, {name: parameter.value for name, parameter in stage.parameters.items()}]
        for slot, stage in model.stages().items()
    }
    effects = [[added.effect, added.parameters] for added in model.effects]
    own = asdict(fingerprint) | {"checksum": ""} | FORMER
    own = {name: value for name, value in own.items() if value or name not in LACKS.get(fingerprint.version, ())}
    numbers = [own, model.sample_time_s, model.p0_mpa, model.muscle.input, stages, effects]
    text = json.dumps(_one_zero(numbers), sort_keys=True)
    return f"sha-{hashlib.sha256(text.encode()).hexdigest()[:12]}"


def _one_zero(value: object) -> object:
    """The same without negative zeros: one that stands at its default is not written, and comes back as 0.0."""
    if isinstance(value, float):
        return value + 0.0
    if isinstance(value, dict):
        return {key: _one_zero(item) for key, item in value.items()}
    return [_one_zero(item) for item in value] if isinstance(value, list | tuple) else value


def fingerprint_trouble(model: Model) -> str | None:
    """Why the model's fingerprint cannot be used, in one line; None when it can be, or when there is none."""
    known = model.fingerprint
    if known is None:
        return None
    if known.version not in READ:
        return (
            f"the model's fingerprint is of version {known.version}, this pamrig reads versions up to {VERSION}: it "
            "is not used"
        )
    if known.checksum != fingerprint_checksum(known, model):
        return (
            "the model's parameters or its fingerprint were changed after the identification: the fingerprint "
            "is not used"
        )
    return None
