"""`pamrig validate`: models beside each other."""

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from support.records.made_logs import made_log

from rig.app import shipped
from rig.channels import PNEUMATIC
from rig.cli.model.identify import validate
from rig.report.fit_figures import comparison_figure


def test_models_of_one_file_name_each_have_their_column(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Only the last was there; in the figures its curve stood in place of the model that is validated, too."""
    monkeypatch.chdir(tmp_path)  # names so short that a narrow terminal has them on one line
    made_log(Path("rec.mcap"))
    models = [Path(day) / "model.yaml" for day in ("monday", "tuesday", "friday")]
    for model in models:
        model.parent.mkdir()
        model.write_bytes((shipped.configs() / "models" / "simulated.yaml").read_bytes())
    first, second, third = map(str, models)
    done = CliRunner().invoke(validate, [first, "rec.mcap", "--beside", second, "--beside", third])
    assert done.exit_code == 0, done.output
    for beside in (second, third):
        assert beside in done.output


def test_a_model_of_another_sample_time_is_drawn(tmp_path: Path) -> None:
    """It ended the figures by a ValueError of matplotlib."""
    made_log(tmp_path / "rec.mcap")
    text = (shipped.configs() / "models" / "simulated.yaml").read_text()
    first, slow = tmp_path / "first.yaml", tmp_path / "slow.yaml"
    first.write_text(text)
    slow.write_text(text.replace("sample_time_s: 0.005", "sample_time_s: 0.02"))
    more = ["--beside", str(slow), "--resample", "--figures", str(tmp_path / "figures")]
    done = CliRunner().invoke(validate, [str(first), str(tmp_path / "rec.mcap"), *more])
    assert done.exit_code == 0, done.output
    assert list((tmp_path / "figures").glob("*.png"))


def test_each_model_has_a_line_in_a_figure() -> None:
    """A fourth one had none."""
    time_s = np.linspace(0.0, 1.0, 20)
    estimated = {f"model {number}": number + time_s for number in range(8)}
    figure = comparison_figure("rec", time_s, time_s, time_s, estimated, "p1 - p2 [MPa]", PNEUMATIC)
    assert len(figure.axes[0].lines) == 1 + len(estimated)
