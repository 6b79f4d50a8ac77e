"""Where every figure begins: an empty one. What a command draws shows the same whoever calls it and wherever: the
settings that somebody keeps for his own plots, in a file `matplotlibrc` or in `MPLBACKEND`, are for those.

Loads matplotlib only when a figure is asked for.
"""

import os
from typing import TYPE_CHECKING, Final

from rig.errors import RigError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_SETTINGS: Final = "MATPLOTLIBRC"
_BACKEND: Final = "MPLBACKEND"


def leave_own_settings() -> None:
    """For this process and those that it starts: figures go by what matplotlib comes with. To be called before the
    first figure, by a command; a notebook keeps the settings of its author."""
    os.environ[_SETTINGS] = os.devnull
    os.environ[_BACKEND] = "agg"


def blank_figure(width: float, height: float) -> "Figure":
    """An empty figure of that size in inches. RigError when matplotlib does not load, as over a file of settings that
    is no text."""
    try:
        import matplotlib
        from matplotlib.figure import Figure
    except (ValueError, OSError) as error:
        raise RigError(f"no figure can be drawn: matplotlib does not load: {error}") from None
    if os.environ.get(_SETTINGS) == os.devnull:
        matplotlib.rcdefaults()  # a file in the current folder goes before the one that is named
    return Figure(figsize=(width, height), layout="constrained")
