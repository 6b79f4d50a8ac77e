"""Figures of logs: their cost does not grow with what went wrong in the record."""

import numpy as np
import pytest
from matplotlib.collections import LineCollection

from rig.record import Record
from rig.report.log_figures import run_figure


@pytest.mark.parametrize("missed", [1, 2, 900])
def test_marks_of_missed_ticks_are_one_drawing_in_each_panel(missed: int) -> None:
    """Thousands of single lines took minutes."""
    t_s = np.arange(1000) * 0.005
    late = (np.arange(1000) < missed).astype(float)
    figure = run_figure(Record("made", t_s, np.sin(t_s), 20 * np.sin(t_s), extra={"missed": late}))
    marks = [one for axes in figure.axes for one in axes.collections if isinstance(one, LineCollection)]
    assert len(marks) == 3
    for each in marks:
        assert [float(end[0, 0]) for end in each.get_segments()] == pytest.approx(t_s[:missed])
    assert len(figure.findobj()) < 1000
