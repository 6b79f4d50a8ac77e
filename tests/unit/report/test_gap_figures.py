"""What is drawn and laid out of a diagnosis: words stay in their boxes, legends off the curves, tables on the paper."""

from dataclasses import replace
from pathlib import Path

import pamrig
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.patches import Rectangle
from support import browsers
from support.records.told_answers import cause, told

from rig.gap.answer.facts import Link
from rig.report.gap_figures import chain_figure

PAPER_PX = 718
"""A4 between the margins that a browser prints with, at 96 pixels an inch."""


@pytest.fixture(scope="module")
def said(tmp_path_factory: pytest.TempPathFactory) -> pamrig.Diagnosis:
    """Of an angle alone, which leaves several effects open."""
    sweep = {"duration_s": 8.0, "settle_s": 0.5, "records": [{"sine": {"frequency_hz": 0.5, "amplitude_mpa": 0.2}}]}
    late = pamrig.simulated_rig({"valve_lag": {"tau_s": 0.03}}, seed=3)
    runs = pamrig.run(sweep, late, out=tmp_path_factory.mktemp("late"))
    return pamrig.diagnose("simulated", runs.records, pressures=False)


def test_a_share_stays_in_its_box() -> None:
    made = told(cause("valve_lag", tau_s=(0.01, 0.009, 0.011, "s")))
    links = [Link("timing", ("delay",), 0.004), Link("valve", ("valve_lag",), 0.996)]
    links += [Link(name, (), 0.0) for name in ("muscle", "joint", "sensor")]
    figure = chain_figure(replace(made, where=replace(made.where, chain=tuple(links))))
    FigureCanvasAgg(figure).draw()
    (axes,) = figure.axes
    boxes = [patch.get_window_extent() for patch in axes.patches if isinstance(patch, Rectangle) and not patch.fill]
    texts = [text for text in axes.texts if "%" in text.get_text()]
    assert [text.get_text() for text in texts] == ["< 1 %", "> 99 %"]
    for text, box in zip(texts, boxes, strict=False):
        assert box.x0 < text.get_window_extent().x0 < text.get_window_extent().x1 < box.x1


def test_a_legend_hides_no_curve(said: pamrig.Diagnosis) -> None:
    figure = said.plot().figure
    FigureCanvasAgg(figure).draw()
    for axes in figure.axes:
        legend = axes.get_legend().get_window_extent()
        assert legend.y0 >= axes.get_window_extent().y1


def test_on_paper_and_on_every_screen_nothing_is_cut_at_the_side(said: pamrig.Diagnosis, tmp_path: Path) -> None:
    said.save_page(tmp_path / "report.html")
    with browsers.started() as browser:
        page = browser.new_page(viewport={"width": PAPER_PX, "height": 1000})
        page.emulate_media(media="print")
        page.goto((tmp_path / "report.html").as_uri())
        assert "may also be" in page.inner_text("main")
        assert page.evaluate("document.documentElement.scrollWidth") <= PAPER_PX
        page.emulate_media(media="screen")
        for width in (390, 667, 740, 800, 1280):  # a phone, the same on its side, a tablet, a laptop
            page.set_viewport_size({"width": width, "height": 800})
            assert page.evaluate("document.documentElement.scrollWidth") <= width
