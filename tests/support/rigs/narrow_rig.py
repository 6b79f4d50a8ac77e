"""The simulated rig within limits that leave planned records one rest pressure: a design has a quarter to choose from,
for a call of `gap design` 8 s of processor time in place of 12."""

from pathlib import Path

CONFIGS = Path(__file__).resolve().parents[3] / "configs"


def narrow_rig(folder: Path) -> Path:
    """Its YAML in that folder."""
    text = (CONFIGS / "rigs" / "simulated.yaml").read_text()
    narrow = text.replace("pressure_mpa: [0.0, 0.5]", "pressure_mpa: [0.16, 0.24]")
    assert narrow != text
    place = folder / "narrow.yaml"
    place.write_text(narrow.replace("../models", f"{CONFIGS / 'models'}"))
    return place
