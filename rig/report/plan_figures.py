"""The figure of what a rig can tell: effect beside effect, how far apart they lie."""

from typing import TYPE_CHECKING

import numpy as np

from rig.gap.plan.capability import Capability
from rig.report.blank_figure import blank_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_TOP = 20.0
"""Separations beyond are drawn alike: they are plain."""


def matrix_figure(name: str, found: Capability) -> "Figure":
    """The matrix of what can be told from what: rows are the truth at its usual size, columns what it may be taken for;
    a cross where the two cannot be told apart, or on the diagonal, where the effect is not seen."""
    count = len(found.names)
    figure = blank_figure(3.0 + 0.32 * count, 2.2 + 0.3 * count)
    from matplotlib.colors import LogNorm

    axes = figure.add_subplot()
    shown = np.clip(np.nan_to_num(found.separation, posinf=_TOP), 0.3, _TOP)
    image = axes.imshow(shown, cmap="viridis", norm=LogNorm(0.3, _TOP))
    for i, j in zip(*np.nonzero(found.separation < found.needed), strict=True):
        axes.text(j, i, "x", ha="center", va="center", color="white" if shown[i, j] < found.needed else "black")
    words = [one.replace("_", " ") for one in found.names]
    axes.set_xticks(range(count), words, rotation=90)
    axes.set_yticks(range(count), words)
    axes.set_xlabel("may be taken for")
    axes.set_ylabel("truth")
    axes.set_title(f"{name}: what can be told from what (x: cannot)")
    figure.colorbar(image, ax=axes, label="standard deviations apart (20 and more alike)", shrink=0.8)
    return figure
