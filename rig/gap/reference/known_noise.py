"""What a reference without earlier days knows of the noise of the rig's angle: louder noise is a finding."""

import math
from collections.abc import Sequence

from rig.gap.priors import UsualNoise
from rig.gap.raw_tests.noise import KnownNoise
from rig.gap.raw_tests.noise_levels import span
from rig.gap.reference.kinds import ReferenceKind
from rig.model.parameters import Model
from rig.record import Column

_STAGE, _SIZE = "sensor_noise", "std_deg"


def known_noise(
    kind: ReferenceKind, model: Model | None, usual: UsualNoise | None, angles: Sequence[Column]
) -> KnownNoise | None:
    """A fingerprint's own; beside a simulator what rigs usually have over the span of such angles (deg), with what the
    simulator has of its own. None where neither is known."""
    if model is None or kind.by_days:
        return None
    if kind is ReferenceKind.FINGERPRINT:
        described = model.fingerprint
        return None if described is None or described.noise_deg <= 0.0 else KnownNoise(described.noise_deg)
    if usual is None:
        return None
    own_deg = math.hypot(*(one.parameters[_SIZE] for one in model.effects if one.effect == _STAGE))
    return KnownNoise(math.hypot(usual.level_deg(span(angles)), own_deg), usual.spread)
