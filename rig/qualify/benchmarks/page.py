"""`pamrig bench page`: what the operator's page costs and how soon its Stop is at the device, in Debian's Chromium.

Needs the package playwright and a Chromium. The browser runs on the same machine, without a graphics card: its own time
is part of every figure that it takes part in.
"""

import contextlib
import http.client
import os
import shutil
import signal
import tempfile
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final
from urllib.parse import urlsplit

from rig.errors import RigError
from rig.qualify.benchmarks import figure
from rig.qualify.benchmarks.safety import busy, lateness
from rig.qualify.faults.bench import FaultBench, Spoilt
from rig.qualify.faults.table import estop
from rig.service.records.lateness import quantiles
from rig.service.web.stream.shown_status import FRESH_S

TRIALS: Final = 50
"""Emergency stops."""
VIEWERS: Final = 10
"""Pages that are open at one time."""
PAINTS: Final = 10
"""Loads of the page of which the median counts."""
_SCREEN_HZ: Final = 30.0
"""The page draws every other picture of a screen."""
_ONE_PAGE: Final = "there is no other page of this rig"
_GOAL_STOP_MS: Final = 50.0
_GOAL_PAINT_MS: Final = 500.0
_GOAL_KB: Final = 200.0
_GOAL_STALE_MS: Final = 1000.0
WATCHED_S: Final = 10.0
"""For which the loop and the pictures of a page are counted, s."""
_FLOODS: Final = 4
FREEZES: Final = 5
"""Times that the loop is stopped, to see when the page says that its data are old."""
_PATIENCE_MS: Final = 120_000
"""For a browser whose pages all draw at once on a machine that does other work too."""
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
                **_stale(chromium, bench, url),
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
    context.set_default_timeout(_PATIENCE_MS)
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
    for _ in range(PAINTS):
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
    connection = _connected(url)
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


@dataclass(frozen=True)
class _Watched:
    """A sweep while so many pages look."""

    late_us: list[float]
    server_share: float
    """Of one core."""
    browser_share: float
    """Of one core, all its processes together."""
    frames: list[float]
    """Pictures a second, of each page."""


def _viewers(chromium: Any, bench: FaultBench, url: str) -> dict[str, Any]:
    """Frames, processor time of server and browser, and the loop's lateness with one viewer and with ten, beside nobody
    looking; and its lateness while the page is flooded."""
    before = lateness(bench, WATCHED_S)
    one, many = _watched(chromium, bench, url, 1), _watched(chromium, bench, url, VIEWERS)
    with _flood(url):
        flooded = quantiles(lateness(bench, WATCHED_S))
    quiet, watched = quantiles(before + lateness(bench, WATCHED_S)), quantiles(many.late_us)
    front, alone = many.frames[0], one.frames[0]
    screen: dict[str, Any] = {"better": "higher", "limit": "the screen", "limit_value": _SCREEN_HZ}
    return {
        "frames a second, one viewer": figure(alone, "1/s", **screen),
        f"frames a second of one page, {VIEWERS} viewers": figure(front, "1/s", "one viewer", alone, better="higher"),
        **_shares("one viewer", one),
        **_shares(f"{VIEWERS} viewers, {sum(rate > 1 for rate in many.frames)} of them drawing", many),
        f"lateness p50, {VIEWERS} viewers": figure(watched["p50"], "us", "nobody looks", quiet["p50"]),
        f"lateness p99, {VIEWERS} viewers": figure(watched["p99"], "us", "nobody looks", quiet["p99"]),
        f"lateness p99, {_FLOODS} floods of the page": figure(flooded["p99"], "us", "nobody looks", quiet["p99"]),
    }


def _shares(who: str, seen: _Watched) -> dict[str, Any]:
    return {
        f"server's share of a core, {who}": figure(100 * seen.server_share, "%", why=_ONE_PAGE),
        f"browser's share of a core, {who}": figure(100 * seen.browser_share, "%", why=_ONE_PAGE),
    }


def _watched(chromium: Any, bench: FaultBench, url: str, count: int) -> _Watched:
    with looking(chromium, url, count) as pages:
        pages[0].bring_to_front()
        bench.ready()
        began_s, server_s, browser_s = time.monotonic(), _cpu_s(bench), _browser_s(chromium)
        late = lateness(bench, WATCHED_S)
        spent_s = time.monotonic() - began_s
        shares = (_cpu_s(bench) - server_s) / spent_s, (_browser_s(chromium) - browser_s) / spent_s
        return _Watched(late, *shares, [_frames(page) for page in pages])


def _frames(page: Any) -> float:
    """Pictures a second as the page counts them; 0 where it has not begun to."""
    return float((page.locator("#rate").inner_text().split() or ["0"])[0])


def _browser_s(chromium: Any) -> float:
    """Processor time of all processes of the browser so far, as it says itself."""
    session = chromium.new_browser_cdp_session()
    each_process = session.send("SystemInfo.getProcessInfo")["processInfo"]
    session.detach()
    return sum(float(process["cpuTime"]) for process in each_process)


@contextlib.contextmanager
def _flood(url: str) -> Iterator[None]:
    """Clients that ask the page for the status as fast as they are let."""
    over = threading.Event()
    threads = [threading.Thread(target=_ask_on, args=(url, over)) for _ in range(_FLOODS)]
    with busy(threads, over):
        yield


def _ask_on(url: str, over: threading.Event) -> None:
    while not over.is_set():
        with contextlib.suppress(OSError, http.client.HTTPException), contextlib.closing(_connected(url)) as connection:
            while not over.is_set():
                connection.request("GET", "/api/status")
                connection.getresponse().read()


def _connected(url: str) -> http.client.HTTPConnection:
    place = urlsplit(url)
    return http.client.HTTPConnection(place.hostname or "", place.port, timeout=20)


def _cpu_s(bench: FaultBench) -> float:
    """Processor time of the page's process so far (proc(5), stat, utime and stime)."""
    stat = Path(f"/proc/{bench.status()['page']['pid']}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(stat[11]) + int(stat[12])) / os.sysconf("SC_CLK_TCK")


def _stale(chromium: Any, bench: FaultBench, url: str) -> dict[str, Any]:
    """From the moment the daemon freezes until the page says that what it shows is old."""
    times = []
    with looking(chromium, url) as (page,):
        for _ in range(FREEZES):
            page.locator("#stale").wait_for(state="hidden")
            begun = page.evaluate("performance.now()")
            bench.send("control", signal.SIGSTOP)
            times.append(float(page.evaluate(_SAID_STALE)) - begun)
            bench.revive()
    row = figure(max(times), "ms", limit="what is still fresh", limit_value=1000 * FRESH_S, goal=_GOAL_STALE_MS)
    return {f"old data said to be old: max of {FREEZES}": row}


_SAID_STALE: Final = """new Promise((said) => {
  const look = setInterval(() => {
    if (document.getElementById("stale").hidden) return;
    clearInterval(look);
    said(performance.now());
  }, 5);
})"""
