"""Pages from templates: everything that is filled in is escaped, and nothing may be missing."""

from collections.abc import Callable, Mapping
from importlib.resources import files
from types import MappingProxyType
from typing import Any

import jinja2

from rig.report.shown_text import in_lines


def rendered(source: str, filters: Mapping[str, Callable[..., object]] = MappingProxyType({}), **words: object) -> str:
    """The page that a template makes of these words. What a record says of itself may hold control characters, which a
    browser passes over and a terminal obeys: they are written out."""
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True, finalize=_shown
    )
    environment.filters |= filters
    return environment.from_string(source).render(words)


def template(name: str) -> str:
    """The text of a template that lies beside this module."""
    return files("rig.report").joinpath(name).read_text(encoding="utf-8")


def _shown(value: Any) -> Any:
    return in_lines(value) if type(value) is str else value
