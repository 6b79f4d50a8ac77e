"""A Python file that belongs to no package, as a module: scripts of the pages, examples."""

import importlib.util
from pathlib import Path
from types import ModuleType


def module_at(place: Path) -> ModuleType:
    """The file, carried out anew."""
    spec = importlib.util.spec_from_file_location(place.stem, place)
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
