"""What the site has beside the pages: the order of its sections, from docs/index.py, and CONTRIBUTING.md as a page.

Called by mkdocs (configs/mkdocs.yml); the pages themselves stay as they read in a checkout.
"""

import importlib.util
from pathlib import Path
from types import ModuleType
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

DOCS = Path(__file__).resolve().parent
NOTEBOOKS = ("first_sweep", "identify_and_validate", "find_a_gap", "campaign")


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Sections and pages in the order of docs/README.md, then the notebooks and the decisions."""
    index = _index()
    sections: list[Any] = [{"Contents": "README.md"}]
    for folder, (heading, _) in index.SECTIONS.items():
        sections.append({heading: [line for about, pages in index.groups(folder) for line in _lines(about, pages)]})
    sections.insert(2, {"Notebooks": [f"notebooks/{name}.ipynb" for name in NOTEBOOKS]})
    sections.append({"Decisions, and why": _lines("", [index.DECISIONS, *index.decisions()])})
    config.nav = [*sections, {"Contributing": "contributing.md"}]
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """CONTRIBUTING.md lies above the pages, and other pages link to it."""
    text = (DOCS.parent / "CONTRIBUTING.md").read_text(encoding="utf-8")
    files.append(File.generated(config, "contributing.md", content=text.replace("](docs/", "](")))
    return files


def on_page_markdown(markdown: str, **_: object) -> str:
    """Links to it lead to its page."""
    return markdown.replace("](../../CONTRIBUTING.md)", "](../contributing.md)").replace(
        "](../CONTRIBUTING.md)", "](contributing.md)"
    )


def _lines(about: str, pages: list[Path]) -> list[Any]:
    """Pages of the menu, under what they are about."""
    places = [page.relative_to(DOCS).as_posix() for page in pages]
    return [{about: places}] if about else places


def _index() -> ModuleType:
    spec = importlib.util.spec_from_file_location("index", DOCS / "index.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
