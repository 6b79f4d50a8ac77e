"""Debian's Chromium, driven by Playwright: for the tests of the page. Where there is none they skip with a reason, or
fail where PAMRIG_BROWSER=required says that there must be one."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from conftest import ROOT

REBOUND = "rebound.example"
"""A name that leads to this machine, as somebody's server on the network could make one (DNS rebinding)."""
FLAGS = (
    f"--host-resolver-rules=MAP {REBOUND} 127.0.0.1",
    "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync",
)  # fmt: skip
AXE = ROOT / "tests" / "support" / "axe" / "axe.min.js"


def path() -> str:
    """Where the browser is; skips the test where it is not."""
    found = os.environ.get("PAMRIG_BROWSER_PATH") or shutil.which("chromium") or shutil.which("chromium-browser")
    if found:
        return found
    if os.environ.get("PAMRIG_BROWSER") == "required":
        pytest.fail("no Chromium on this machine, and PAMRIG_BROWSER=required")
    pytest.skip("no Chromium on this machine; Debian has it as the package chromium")


@contextmanager
def started() -> Iterator[Any]:
    """A browser without a screen."""
    sync_api = pytest.importorskip("playwright.sync_api")
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path(), args=list(FLAGS))
        try:
            yield browser
        finally:
            browser.close()


def violations(page: Any) -> list[str]:
    """What axe finds wrong with the page as it is now, a line each."""
    if not page.evaluate("typeof axe !== 'undefined'"):
        page.evaluate(AXE.read_text(encoding="utf-8"))
    found = page.evaluate("axe.run(document, {resultTypes: ['violations']}).then((result) => result.violations)")
    return [f"{one['id']}: {node['target']} {node['failureSummary']}" for one in found for node in one["nodes"]]
