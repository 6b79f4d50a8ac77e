"""Pictures of results: a matplotlib figure that a notebook shows by itself, without a backend; and tables, in HTML for
a notebook and as text elsewhere."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
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


@dataclass(frozen=True)
class Table:
    """What a result shows of itself: rows under titles, below a line."""

    head: Sequence[str]
    rows: Sequence[Sequence[object]]
    title: str = ""

    def to_html(self) -> str:
        """As HTML; everything in it is text."""
        title = f"<p><b>{escape(self.title)}</b></p>" if self.title else ""
        titles = "".join(f"<th>{escape(each)}</th>" for each in self.head)
        body = "".join(f"<tr>{''.join(f'<td>{escape(str(cell))}</td>' for cell in row)}</tr>" for row in self.rows)
        return f"{title}<table><thead><tr>{titles}</tr></thead><tbody>{body}</tbody></table>"

    def to_text(self) -> str:
        """As lines of text, columns under each other; titles only where there are any."""
        lines = [[str(cell) for cell in row] for row in ([self.head] if any(self.head) else []) + [*self.rows]]
        widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
        text = ["  ".join(map(str.ljust, line, widths)).rstrip() for line in lines]
        return "\n".join(([self.title] if self.title else []) + text)


class Tabled(ABC):
    """A result that shows itself: as a table in a notebook, as the same text where it is printed."""

    @abstractmethod
    def _table(self) -> Table:
        """What is shown."""

    def _repr_html_(self) -> str:
        return self._table().to_html()

    def __repr__(self) -> str:
        return self._table().to_text()


def shown(value: float | None, digits: int = 3) -> str:
    """A number for a table; empty for none."""
    return "" if value is None else f"{value:.{digits}g}"
