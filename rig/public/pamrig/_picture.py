"""Pictures of results: a matplotlib figure that a notebook shows by itself, without a backend; and tables in HTML."""

from collections.abc import Iterable, Sequence
from html import escape
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from pamrig._places import place_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_DPI = 80


class Picture:
    """A drawn result. A notebook shows it; `figure` is the matplotlib figure, to be changed at will.

    >>> picture = pamrig.read("first").plot()
    >>> picture.save("loop.png")
    """

    def __init__(self, figure: "Figure") -> None:
        self.figure = figure

    def save(self, place: str | Path) -> None:
        """Write it as PNG, SVG or PDF by the suffix; `pamrig.Error` when that fails."""
        from rig.report.log_figures import save

        save(self.figure, place_of(place, "save"))

    def _repr_png_(self) -> bytes:
        from rig.report.figure_texts import as_written

        png = BytesIO()
        as_written(self.figure)
        self.figure.savefig(png, format="png", dpi=_DPI)
        return png.getvalue()


def html_table(head: Sequence[str], rows: Iterable[Sequence[object]], title: str = "") -> str:
    """A table of HTML; everything in it is text."""
    said = f"<p><b>{escape(title)}</b></p>" if title else ""
    titles = "".join(f"<th>{escape(each)}</th>" for each in head)
    body = "".join(f"<tr>{''.join(f'<td>{escape(str(cell))}</td>' for cell in row)}</tr>" for row in rows)
    return f"{said}<table><thead><tr>{titles}</tr></thead><tbody>{body}</tbody></table>"


def shown(value: float | None, digits: int = 3) -> str:
    """A number for a table; empty for none."""
    return "" if value is None else f"{value:.{digits}g}"
