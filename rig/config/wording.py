"""What messages say of what somebody wrote: of one line, and never the whole of something long."""

import difflib
import unicodedata
from pathlib import Path

from rig.errors import ConfigError

LONG_NUMBER = 10**20
"""A whole number from here on is not written out."""
_SHOWN_CHARACTERS = 200
_NO_LINE = ("Cc", "Zl", "Zp")
"""Unicode's categories of what ends a line or commands a terminal."""


def one_line(name: str, where: str) -> str:
    """A name itself; ConfigError for one that ends a line or commands a terminal, where it is shown."""
    if any(unicodedata.category(one) in _NO_LINE for one in name):
        raise ConfigError(
            f"{where}: expected text of one line, got {shown(name)}; behind `>` or `|` a minus drops the line's end"
        )
    return name


def suggest(name: str, allowed: list[str]) -> str:
    """The end of a message about an unknown name: the nearest known one, or all of them."""
    near = difflib.get_close_matches(name, allowed, n=1, cutoff=0.65) if len(name) <= _SHOWN_CHARACTERS else []
    return f"did you mean {near[0]!r}?" if near else f"allowed: {', '.join(sorted(allowed))}"


def shown(raw: object) -> str:
    """What somebody wrote, for a message of one line: never the whole of something long."""
    kind = {dict: "a mapping", list: "a list", type(None): "nothing"}.get(type(raw))
    if isinstance(raw, int) and abs(raw) >= LONG_NUMBER:
        return "a number of more than 20 digits"
    text = f"{raw!r}"
    return kind or (text if len(text) <= _SHOWN_CHARACTERS else f"{text[:_SHOWN_CHARACTERS]}...")


def nearest_file(path: Path) -> str:
    """The end of a message about a missing file: the one beside it that may have been meant."""
    try:
        names = [p.name for p in path.parent.iterdir()]
    except OSError:
        return f" (nor a folder {path.parent})"
    near = difflib.get_close_matches(path.name, names, n=1)
    return f"; did you mean {path.parent / near[0]}?" if near else ""
