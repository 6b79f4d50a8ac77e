"""What a rig allows the records that are planned or recommended. By itself, because a diagnosis asks for it and plans
nothing: what a plan imports takes it half a second."""

from dataclasses import replace
from pathlib import Path

from rig.app.shipped import find_config
from rig.gap.plan.candidates import SweepEnvelope
from rig.rig_config import load_rig


def envelope_of(rig: Path | None) -> SweepEnvelope:
    """What the rig's YAML allows planned records; careful bounds without one."""
    if rig is None:
        return SweepEnvelope()
    limits = load_rig(find_config(rig, "rigs")).limits
    low, high = limits.pressure_mpa
    careful = SweepEnvelope()
    return replace(
        careful,
        pressure_mpa=(max(low, careful.pressure_mpa[0]), min(high, careful.pressure_mpa[1])),
        slew_mpa_s=limits.slew_mpa_s,
        angle_deg=limits.angle_deg,
    )
