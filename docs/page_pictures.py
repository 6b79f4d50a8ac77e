"""The pictures of the operator's page in the docs: `python docs/page_pictures.py` makes them anew, with a daemon of its
own on a simulated rig and Debian's Chromium."""

import tempfile
from pathlib import Path
from typing import Any

from rig.qualify.benchmarks.page import browser
from rig.qualify.faults.bench import FaultBench

IMAGES = Path(__file__).resolve().parent / "images"
DESK, PHONE = {"width": 1280, "height": 1440}, {"width": 390, "height": 800}
WATCHED_MS = 12_000
"""Until there are some turns of the loop to see."""


def main() -> None:
    """Every picture."""
    with tempfile.TemporaryDirectory() as folder, FaultBench(Path(folder), web=True) as bench:
        bench.ready()
        url = bench.status()["page"]["url"]
        with browser() as chromium:
            _picture(chromium, url, "page_running.png", DESK, "light")
            _picture(chromium, url, "page_phone.png", PHONE, "dark")
            _stopped(chromium, url, "page_stopped.png")


def _picture(chromium: Any, url: str, name: str, size: dict[str, int], scheme: str) -> None:
    page = chromium.new_page(viewport=size, color_scheme=scheme)
    page.goto(url)
    page.wait_for_timeout(WATCHED_MS)
    page.screenshot(path=IMAGES / name)
    page.close()


def _stopped(chromium: Any, url: str, name: str) -> None:
    page = chromium.new_page(viewport={"width": 1280, "height": 560}, color_scheme="light")
    page.goto(url)
    page.wait_for_timeout(1000)
    page.click("#stop-button")
    page.locator("#fault").wait_for()
    page.wait_for_timeout(500)
    page.screenshot(path=IMAGES / name)
    page.close()


if __name__ == "__main__":
    main()
