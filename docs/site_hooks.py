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
    """Sections and pages in the order of docs/README.md, then the notebooks."""
    index = _index()
    sections: list[Any] = [{"Contents": "README.md"}]
    for folder, heading in index.SECTIONS.items():
        pages = sorted((DOCS / folder).glob("*.md"), key=lambda page: (index.place(page.stem), page.name))
        sections.append({heading: [f"{folder}/{page.name}" for page in pages]})
    sections.insert(2, {"Notebooks": [f"notebooks/{name}.ipynb" for name in NOTEBOOKS]})
    config.nav = [*sections, {"Contributing": "contributing.md"}]
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """CONTRIBUTING.md lies above the pages, and other pages link to it."""
    text = (DOCS.parent / "CONTRIBUTING.md").read_text(encoding="utf-8")
    files.append(File.generated(config, "contributing.md", content=text.replace("](docs/", "](")))
    return files


def on_page_markdown(markdown: str, **_: object) -> str:
    """Links to it lead to its page."""
    return markdown.replace("](../../CONTRIBUTING.md)", "](../contributing.md)")


def _index() -> ModuleType:
    spec = importlib.util.spec_from_file_location("index", DOCS / "index.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
