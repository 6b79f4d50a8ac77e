"""What the tests of `pamrig run` carry out, as fixtures."""

from pathlib import Path

import pytest

from rig.app import shipped
from support.run_command import SWEEP


@pytest.fixture
def sweep(tmp_path: Path) -> Path:
    path = tmp_path / "short.yaml"
    path.write_text(SWEEP)
    return path


@pytest.fixture
def rig(tmp_path: Path) -> Path:
    """The simulated rig with the patience that a test on a busy machine needs."""
    text = shipped.default_rig().read_text().replace("../models", str(shipped.configs() / "models"))
    path = tmp_path / "patient.yaml"
    path.write_text(
        text.replace("stall_periods: 40", "stall_periods: 1000").replace("misses_per_s: 20", "misses_per_s: 1000")
    )
    return path
