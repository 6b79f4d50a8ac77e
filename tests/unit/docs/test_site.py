"""The site builds from the pages: every link and anchor leads somewhere, search works from the disk, nothing is
fetched from elsewhere for it."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import ROOT

COMMAND = [sys.executable, "-m", "mkdocs", "build", "-f", str(ROOT / "configs" / "mkdocs.yml"), "-d"]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The whole site, built strictly: a warning is an error."""
    folder = tmp_path_factory.mktemp("site")
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    done = subprocess.run([*COMMAND, folder], env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


def test_every_page_and_notebook_is_there(site: Path) -> None:
    pages = [page.relative_to(ROOT / "docs") for page in (ROOT / "docs").rglob("*") if page.suffix in (".md", ".ipynb")]
    wanted = {page.with_suffix(".html") for page in pages if page.parts[0] != "examples" and page.name != "README.md"}
    built = {page.relative_to(site) for page in site.rglob("*.html")}
    assert wanted <= built
    assert {Path("index.html"), Path("contributing.html")} <= built
    assert "data:image/png;base64" in (site / "notebooks" / "first_sweep.html").read_text()


def test_search_works_from_the_disk(site: Path) -> None:
    assert "hysteresis" in (site / "search" / "search_index.js").read_text()
    browser = shutil.which("chromium")
    if browser is None:
        pytest.skip("no chromium to open the site in")
    page = f"{(site / 'index.html').as_uri()}?q=hysteresis"
    call = [browser, "--headless", "--no-sandbox", "--disable-gpu", "--virtual-time-budget=20000", "--dump-dom", page]
    shown = subprocess.run(call, capture_output=True, text=True, check=True, timeout=100).stdout
    assert re.search(r"[1-9]\d* matching documents", shown)


def test_a_page_fetches_no_script_style_or_font_from_elsewhere(site: Path) -> None:
    fetched = re.compile(r"<(?:script|link)\b[^>]*\b(?:src|href)=\"?https?://[^>]*(?:\.js|\.css|shim|fonts)[^>]*>")
    assert not {page.name: found[0] for page in site.rglob("*.html") if (found := fetched.search(page.read_text()))}


def test_a_broken_link_fails_the_build(tmp_path: Path) -> None:
    (tmp_path / "docs").mkdir()
    (tmp_path / "docs" / "index.md").write_text("# Title\n\n[nowhere](nowhere.md)\n")
    (tmp_path / "mkdocs.yml").write_text("site_name: x\nstrict: true\nvalidation: {links: {not_found: warn}}\n")
    call = [*COMMAND[:5], str(tmp_path / "mkdocs.yml"), "-d", str(tmp_path / "site")]
    assert subprocess.run(call, capture_output=True, check=False).returncode == 1
