"""The simulated rig within limits that leave planned records one rest pressure, and with few effects that it can have:
a design has a quarter to choose from, and a third to weigh."""

from pathlib import Path

from conftest import CONFIGS

LIMITS = "pressure_mpa: [0.0, 0.5]"
FEW = (
    "delay", "valve_gain", "valve_lag", "fill_exhaust_asymmetry", "coulomb_friction", "backlash", "sensor_lag",
    "sensor_gain",
)  # fmt: skip
"""Two or more of each stage, some of them alike."""


def narrow_rig(folder: Path) -> Path:
    """Its YAML in that folder."""
    text = rig_of_few_effects()
    assert LIMITS in text
    place = folder / "narrow.yaml"
    place.write_text(text.replace(LIMITS, "pressure_mpa: [0.16, 0.24]"))
    return place


def rig_of_few_effects() -> str:
    """The simulated rig's YAML, within its own limits."""
    text = (CONFIGS / "rigs" / "simulated.yaml").read_text()
    return f"{text.replace('../models', str(CONFIGS / 'models'))}\neffects: [{', '.join(FEW)}]\n"
