"""The documentation is true: its commands run, its Python runs, its YAML loads, its links lead somewhere, its index is
complete.

On a page, ```console blocks hold lines `$ pamrig ...`, ```yaml file=NAME blocks become files, and ```python blocks are
programs; all of a page are carried out in order in one empty folder.
"""

import re
import shlex
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from conftest import ROOT
from support.script import module_at
from support.warm import Warm

PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
BLOCK = re.compile(r"^```(\w+)(?: file=(\S+))?\n(.*?)^```$", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\(([^)#\s]+)(?:#[^)]*)?\)")
NAMED = re.compile(r"`(?:(?:\.venv/bin/)?python )?((?:rig|drivers|hil|tests|docs|configs)/[\w./-]*\w)(?![\w./*{-])")
"""A file or folder of the checkout, alone or in a call."""


def snippets(page: Path) -> list[tuple[str, str, str]]:
    """(language, file, text) of every block that can be carried out."""
    found = [(m[1], m[2] or "", m[3]) for m in BLOCK.finditer(page.read_text(encoding="utf-8"))]
    return [s for s in found if s[0] in ("console", "python") or s[1]]


def name(page: Path) -> str:
    return str(page.relative_to(ROOT))


def carried_out(page: Path) -> Any:
    """The page as a parameter: only where devices are probed does anything keep real time."""
    probes = any("$ pamrig devices probe" in text for _, _, text in snippets(page))
    return pytest.param(page, marks=[pytest.mark.real_time] if probes else [], id=name(page))


@pytest.mark.parametrize("page", [carried_out(page) for page in PAGES if snippets(page)])
def test_what_a_page_says_can_be_done(page: Path, tmp_path: Path, warm: Warm) -> None:
    for language, file, text in snippets(page):
        if file:
            (tmp_path / file).write_text(text)
            continue
        lines = [line[2:] for line in text.splitlines() if line.startswith("$ ")]
        calls = [["-c", text]] if language == "python" else [shlex.split(line, comments=True) for line in lines]
        for call in calls:
            status, written = warm.run(call, tmp_path)
            assert status == 0, f"{shlex.join(call)}\n{written}"


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_links_lead_somewhere(page: Path) -> None:
    targets = [link for link in LINK.findall(page.read_text(encoding="utf-8")) if "://" not in link]
    assert not [link for link in targets if not (page.parent / link).exists()]


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_a_page_has_one_title(page: Path) -> None:
    text = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    assert len(re.findall(r"^# ", text, re.MULTILINE)) == 1


@pytest.fixture(scope="module")
def index() -> ModuleType:
    """docs/index.py, which is no package."""
    return module_at(ROOT / "docs" / "index.py")


def test_the_indexes_hold_every_page(index: ModuleType) -> None:
    found = index.indexes()
    assert all(page.read_text(encoding="utf-8") == text for page, text in found.items()), "run `python docs/index.py`"
    listed = {(page.parent / link).resolve() for page, text in found.items() for link in LINK.findall(text)}
    assert not [name(page) for page in PAGES[1:] if page.name != "README.md" and page not in listed]


def test_decisions_stand_in_an_index_of_their_own(index: ModuleType) -> None:
    """One link away: among them a newcomer found nothing else."""
    text = (ROOT / "docs" / "README.md").read_text(encoding="utf-8")
    assert [link for link in LINK.findall(text) if link.startswith("decisions/")] == ["decisions/README.md"]


def test_pages_name_only_files_that_exist() -> None:
    """Decisions say what was when they were made; all other pages say what is."""
    decisions = ROOT / "docs" / "decisions"
    named = [
        (name(page), file)
        for page in (ROOT / "CONTRIBUTING.md", *PAGES)
        if decisions not in page.parents
        for file in NAMED.findall(page.read_text(encoding="utf-8"))
    ]
    assert len(named) > 100
    assert not [(page, file) for page, file in named if not (ROOT / file).exists()]


def test_the_overview_names_only_modules_that_exist() -> None:
    text = (ROOT / "docs" / "explanation" / "overview.md").read_text(encoding="utf-8")
    known = {path.name for room in ("rig", "drivers", "hil") for path in (ROOT / room).rglob("*.py")}
    assert not set(re.findall(r"`([a-z_]+\.py)`", text)) - known


SHOW_PRIVATE_ROOMS = {
    "blind_check.md": "for who checks the method on plants of the house",
    "modbus_modules.md": "for who writes a map that only the driver reads",
    "log_format.md": "says that they are private, below the public way",
}
"""Page -> why it may import what the page on Python calls private."""


def test_a_page_for_users_imports_nothing_that_is_private() -> None:
    """The page on the daemon told how to import its client from a private room."""
    imports = re.compile(r"^(?:from|import) (?:rig|drivers|hil)\b.*", re.MULTILINE)
    shown = {page.name for page in PAGES if page.parent.name != "decisions" and imports.search(page.read_text("utf-8"))}
    assert shown == set(SHOW_PRIVATE_ROOMS)
