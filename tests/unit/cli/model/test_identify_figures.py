"""`pamrig identify --figures`: what was fitted is what is drawn."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from support.records.made_logs import made_content, made_log

from rig.cli.model.identify import identify
from rig.log.convert import write_content
from rig.report import fit_files
from rig.report.fit_figures import comparison_figure

QUICK = ("--seeds", "1", "--particles", "4", "--iterations", "3", "--no-polish", "--unbounded")


def test_rows_that_were_kept_from_the_fit_are_not_drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever `--until` said, the figures went to the end of the record."""
    made_log(tmp_path / "rec.mcap")
    drawn_until_s = []

    def watched(title: str, t_s: Any, *more: Any) -> Any:
        drawn_until_s.append(t_s[-1])
        return comparison_figure(title, t_s, *more)

    monkeypatch.setattr(fit_files, "comparison_figure", watched)
    out = ["-o", str(tmp_path / "m.yaml"), "--figures", str(tmp_path / "figures")]
    done = CliRunner().invoke(identify, [str(tmp_path / "rec.mcap"), *out, "--until", "2", *QUICK])
    assert done.exit_code == 0, done.output
    assert drawn_until_s == [pytest.approx(2.0, abs=0.01)]


def test_a_record_called_as_the_convergence_has_a_figure_of_its_own(tmp_path: Path) -> None:
    """It was drawn over the convergence, which was lost without a word."""
    content = made_content(400)
    write_content(replace(content, run_facts={**content.run_facts, "name": "convergence"}), tmp_path / "rec.mcap")
    out = ["-o", str(tmp_path / "m.yaml"), "--figures", str(tmp_path / "figures")]
    done = CliRunner().invoke(identify, [str(tmp_path / "rec.mcap"), *out, *QUICK])
    assert done.exit_code == 0, done.output
    assert {each.name for each in (tmp_path / "figures").glob("*.png")} == {"convergence.png", "convergence_2.png"}
