"""A file that a rig's YAML names and that is not there: the YAML, the key, and where it was looked for."""

from pathlib import Path

import pytest

from rig.app import compose
from rig.errors import ConfigError

RIG = Path(compose.__file__).parents[2] / "configs" / "rigs" / "simulated.yaml"


def test_a_model_that_is_missing(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text(RIG.read_text().replace("../models/simulated.yaml", "models/mine.yaml"))
    with pytest.raises(ConfigError) as caught:
        compose.load(path)
    assert str(caught.value) == (
        f"{path}: devices.main.model: models/mine.yaml: no such file; looked for at "
        f"{tmp_path.resolve()}/models/mine.yaml"
    )


def test_a_calibration_that_is_missing(tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    model = RIG.parent.parent / "models" / "simulated.yaml"
    path.write_text(RIG.read_text().replace("../models/simulated.yaml", str(model)) + "calibration: cal.yaml\n")
    with pytest.raises(ConfigError) as caught:
        compose.load(path)
    assert (
        str(caught.value) == f"{path}: calibration: cal.yaml: no such file; looked for at {tmp_path.resolve()}/cal.yaml"
    )


@pytest.mark.parametrize("name", ["x" * 5000, "a/" * 3000 + "x"])
def test_a_name_that_no_file_can_have_is_one_of_a_file_that_is_missing(tmp_path: Path, name: str) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text(RIG.read_text().replace("../models/simulated.yaml", f"{name}.yaml"))
    with pytest.raises(ConfigError, match="no such file"):
        compose.load(path)
