"""`pamrig bench page`: what the operator's page costs and how soon its Stop is at the device, in Debian's Chromium.

Needs the package playwright and a Chromium. The browser runs on the same machine, without a graphics card: its own time
is part of every figure that it takes part in.
"""

import contextlib
import http.client
import os
import shutil
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final
from urllib.parse import urlsplit

from rig.errors import RigError
from rig.qualify.benchmarks import figure
from rig.qualify.benchmarks.safety import estop, lateness
from rig.qualify.faults.bench import FaultBench, Spoilt
from rig.qualify.lateness import quantiles

TRIALS: Final = 50
VIEWERS: Final = 10
_PAINTS: Final = 10
_SCREEN_HZ: Final = 30.0
"""The page draws every other picture of a screen."""
_ONE_PAGE: Final = "there is no other page of this rig"
_GOAL_STOP_MS: Final = 50.0
_GOAL_PAINT_MS: Final = 500.0
_GOAL_KB: Final = 200.0
_WATCHED_S: Final = 10.0
_HEAD_BYTES: Final = 500
"""Of an answer's headers, about."""
FLAGS: Final = (
    "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync",
)  # fmt: skip


def bench_page(trials: int = TRIALS) -> dict[str, Any]:
    """Figures by name."""
    with tempfile.TemporaryDirectory(prefix="pamrig-") as folder, FaultBench(Path(folder), web=True) as bench:
        bench.start()
        with browser() as chromium:
            url = bench.status()["page"]["url"]
            return {
                **_first_look(chromium, url),
                **_stops(chromium, bench, url, trials),
                **_viewers(chromium, bench, url),
            }


@contextlib.contextmanager
def browser() -> Iterator[Any]:
    """Chromium without a screen; RigError where there is none."""
    from playwright.sync_api import sync_playwright

    path = shutil.which("chromium") or shutil.which("chromium-browser")
    if path is None:
        raise RigError("no Chromium on this machine; Debian has it as the package chromium")
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=path, args=list(FLAGS))
        try:
            yield chromium
        finally:
            chromium.close()


@contextlib.contextmanager
def looking(chromium: Any, url: str, pages: int = 1) -> Iterator[list[Any]]:
    """So many pages of one visitor, each alive."""
    context = chromium.new_context(viewport={"width": 1280, "height": 900})
    try:
        opened = [context.new_page() for _ in range(pages)]
        for page in opened:
            page.goto(url)
            page.locator("#now-viewers", has_text="page").wait_for()
        yield opened
    finally:
        context.close()


def _first_look(chromium: Any, url: str) -> dict[str, Any]:
    """First paint from an empty cache, and what went over the wire for it."""
    paints, weight = [], 0
    for _ in range(_PAINTS):
        context = chromium.new_context()
        page = context.new_page()
        sizes: list[int] = []
        page.on("response", lambda answer, sizes=sizes: sizes.append(_bytes_of(answer)))
        page.goto(url, wait_until="load")
        page.locator("#now-viewers", has_text="page").wait_for()
        paints.append(float(page.evaluate(_FIRST_PAINT)))
        weight = sum(sizes)
        context.close()
    return {
        "first paint: p50": figure(quantiles(paints)["p50"], "ms", goal=_GOAL_PAINT_MS, why=_ONE_PAGE),
        "page weight": figure(weight / 1000, "kB", goal=_GOAL_KB, why=_ONE_PAGE),
    }


def _bytes_of(answer: Any) -> int:
    return int(answer.headers.get("content-length", 0)) + _HEAD_BYTES


_FIRST_PAINT: Final = "performance.getEntriesByName('first-contentful-paint')[0]?.startTime ?? NaN"


def _stops(chromium: Any, bench: FaultBench, url: str, trials: int) -> dict[str, Any]:
    """From the click to the safe set-points at the terminals, beside an emergency stop by the socket, in turn."""
    clicked, called, posted = [], [], []
    with looking(chromium, url) as (page,):
        for _ in range(trials):
            called.append(_trial(bench, lambda: estop(bench)))
            posted.append(_trial(bench, lambda: _post(url)))
            clicked.append(_trial(bench, lambda: _click(page)))
    ours, theirs, alone = quantiles(clicked), quantiles(called), quantiles(posted)
    return {
        "Stop by HTTP without a browser: p50": figure(alone["p50"], "ms", "pamrig estop", theirs["p50"]),
        "Stop by HTTP without a browser: p99": figure(alone["p99"], "ms", "pamrig estop", theirs["p99"]),
        "Stop clicked: p50": figure(ours["p50"], "ms", "pamrig estop", theirs["p50"]),
        "Stop clicked: p99": figure(ours["p99"], "ms", "pamrig estop", theirs["p99"], goal=_GOAL_STOP_MS),
        f"Stop clicked: max of {trials}": figure(ours["max"], "ms", "pamrig estop", theirs["max"]),
    }


def _post(url: str) -> int:
    """The same request as the browser's; returns when it was begun."""
    place = urlsplit(url)
    connection = http.client.HTTPConnection(place.hostname or "", place.port, timeout=20)
    now_ns = time.monotonic_ns()
    connection.request("POST", "/stop", headers={"Origin": url.rstrip("/"), "Accept": "application/json"})
    connection.getresponse().read()
    connection.close()
    return now_ns


def _click(page: Any) -> int:
    """Press the button from within the browser; returns when, by this machine's clock.

    The browser's own driver takes tens of milliseconds to move a pointer there, which is no time of the page's.
    """
    now_ns = time.monotonic_ns()
    page.evaluate("document.getElementById('stop-button').click()")
    return now_ns


def _trial(bench: FaultBench, act: Any) -> float:
    while True:
        bench.ready()
        time.sleep(time.monotonic_ns() % 5_000_000 / 1e9)  # anywhere in the period
        with contextlib.suppress(Spoilt):  # the machine stood still just before
            return bench.ms_to_safe(act())


def _viewers(chromium: Any, bench: FaultBench, url: str) -> dict[str, Any]:
    """Frames, the server's processor time and the loop's lateness with ten viewers, beside nobody looking."""
    before = lateness(bench)
    with looking(chromium, url) as (page,):
        alone = _frames(page)
    with looking(chromium, url, VIEWERS) as pages:
        pages[0].bring_to_front()
        began_s, cpu_s = time.monotonic(), _cpu_s(bench)
        watched = lateness(bench)
        share = (_cpu_s(bench) - cpu_s) / (time.monotonic() - began_s)
        crowded = _frames(pages[0])
    quiet = quantiles(before + lateness(bench))
    return {
        "frames a second, one viewer": figure(
            alone, "1/s", better="higher", limit="the screen", limit_value=_SCREEN_HZ
        ),
        f"frames a second of one page, {VIEWERS} viewers": figure(crowded, "1/s", "one viewer", alone, better="higher"),
        f"server's share of a core, {VIEWERS} viewers": figure(100 * share, "%", why=_ONE_PAGE),
        f"lateness p50, {VIEWERS} viewers": figure(quantiles(watched)["p50"], "us", "nobody looks", quiet["p50"]),
        f"lateness p99, {VIEWERS} viewers": figure(quantiles(watched)["p99"], "us", "nobody looks", quiet["p99"]),
    }


def _frames(page: Any) -> float:
    """Pictures a second as the page counts them, once it has counted for a while."""
    page.wait_for_timeout(_WATCHED_S * 1000)
    page.locator("#rate:not(:empty)").wait_for()  # it counts for two seconds first
    return float(page.locator("#rate").inner_text().split()[0])


def _cpu_s(bench: FaultBench) -> float:
    """Processor time of the page's process so far (proc(5), stat, utime and stime)."""
    stat = Path(f"/proc/{bench.status()['page']['pid']}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(stat[11]) + int(stat[12])) / os.sysconf("SC_CLK_TCK")
