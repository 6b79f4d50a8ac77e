"""The texts of figures: names from records are shown as they are, and nothing of ours is lost."""

import re
import warnings
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from rig.identify.validate import Score
from rig.report.fit_files import write_scores
from rig.report.log_figures import save

NAME = "$\\foo$ \x1b[31m _{x"


@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf"])
def test_a_name_is_no_formula_and_no_command(tmp_path: Path, suffix: str) -> None:
    figure = Figure()
    axes = figure.subplots()
    axes.loglog([1e-3, 1e3], [1.0, 2.0], label=NAME)
    axes.set(xlabel=NAME, title=NAME)
    axes.legend()
    figure.suptitle(NAME)
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # a sign without a glyph would be told to the terminal as it is
        save(figure, tmp_path / f"x{suffix}")
    assert axes.get_title() == "$\\foo$ \\x1b[31m _{x"


def test_powers_of_ten_stay_what_they_are() -> None:
    """What matplotlib itself writes beside an axis is mathematics."""
    from rig.report.figure_texts import as_written

    figure = Figure()
    axes = figure.subplots()
    axes.loglog(np.array([1e-3, 1e3]), [1.0, 2.0])
    figure.draw_without_rendering()
    as_written(figure)
    assert all(label.get_parse_math() for label in axes.get_xticklabels())


@pytest.mark.parametrize("name", ["a|b", "a\nb", "\x1b[31mX", "a\u202eb", "<img src=x>", "[x](y)", "a\\"])
def test_the_name_of_a_file_is_one_cell_of_a_table(tmp_path: Path, name: str) -> None:
    write_scores([Score(f"day/{name}.mcap", 0.2, 0.01, 98.0, 0.4, diverged=False)], tmp_path)
    written = (tmp_path / "scores.md").read_text(), (tmp_path / "scores.csv").read_text()
    assert [len(text.splitlines()) for text in written] == [3, 2]
    assert all(text.replace("\n", "").isprintable() for text in written)
    row = written[0].splitlines()[2]
    assert len(re.split(r"(?<!\\)(?:\\\\)*\|", row)) == 8  # six cells
    assert not re.search(r"(?<!\\)[<\[]", row)
