"""A daemon with its page and Debian's Chromium, one pair for the tests of a file, in a lab that has a past: days of
diagnoses, hunts, and names with markup in them."""

import contextlib
import json
import re
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import psutil
import pytest

from rig.app.gap.hunt.folder import Hunt, HuntStep
from rig.qualify.faults.bench import FaultBench
from support import browsers
from support.rigs.patient_rig import BY_THE_MACHINE, PATIENT

PARTS = ("rig", "runs", "records", "diagnosis", "bringup")
MARKUP = "<img src=x onerror=document.title='hit'>"
DAYS, CHANGED = 12, 7
"""Of diagnoses, and the first on which the gap was another."""
PATIENCE_S = 180.0
"""For what the page shows: records are read by a process that has everybody else go first."""
AT_HAND_S = 60.0
"""For what it has at hand."""
LOOK_S = 10.0
"""Between two looks whether the rig, on which one waits, has faulted."""
REFERENCE = "fingerprint"
"""What the days of before were diagnosed against."""
SHORT = """\
settle_s: 0.1
zero_s: 0.05
ramp_in_s: 0.1
duration_s: 2.5
ramp_out_s: 0.1
records: [{sine: {frequency_hz: 1.0, amplitude_mpa: [0.1, 0.12]}}]
"""


@pytest.fixture(scope="module")
def chromium() -> Iterator[Any]:
    with browsers.started() as browser:
        yield browser


@pytest.fixture(scope="module")
def page_bench(chromium: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[FaultBench]:
    folder = Path(tmp_path_factory.mktemp("browser"))
    (folder / "daemon.yaml").write_text(f"web: {{sweeps: [{folder}]}}\n")
    (folder / "short.yaml").write_text(SHORT)
    (folder / f"{MARKUP}.yaml").write_text(SHORT)
    with FaultBench(folder, PATIENT, arguments=("--config", str(folder / "daemon.yaml")), web=True) as bench:
        a_past(bench.state / "diagnoses", bench.logs)
        bench.start()
        yield bench


def a_past(diagnoses: Path, logs: Path) -> None:
    """Days on which nothing was found, then days with backlash; one hunt that ended and one that goes on."""
    for day in range(DAYS):
        at_s = 1_793_000_000.0 + 86400.0 * day
        folder = diagnoses / time.strftime("%Y%m%dT%H%M%SZ", time.gmtime(at_s))
        folder.mkdir(parents=True)
        asked = {"session": f"day {day:02d}", "model": "simulated", "reference": REFERENCE, "baselines": []}
        (folder / "asked.json").write_text(json.dumps(asked | {"asked_s": at_s, "recorded_s": at_s - 3600.0}))
        (folder / "found.json").write_text(json.dumps(found(day)))
        (folder / "report.html").write_text(f"<!doctype html><title>{day}</title><h1>Report of day {day}</h1>")
    first = HuntStep("step_1.yaml", "parts delay from friction", 2.5, "step_1", (("delay", 0.55), ("valve_lag", 0.4)))
    last = HuntStep("step_2.yaml", f"parts delay from {MARKUP}", 1.2, "step_2", (("delay", 0.97),))
    for name, steps, ended in (
        ("hunt_a", (first, last), "named"),
        ("hunt_b", (first, HuntStep("s.yaml", "y", 4.0)), ""),
    ):
        (logs / name).mkdir(parents=True)
        Hunt(logs / name, {}, steps, ended).save()


def found(day: int) -> dict[str, Any]:
    """The JSON of a diagnosis, as far as the page reads it."""
    width = {"value": 3.5 + 0.05 * day, "low": 3.2 + 0.05 * day, "high": 3.8 + 0.05 * day, "unit": "deg"}
    cause = {"effect": "backlash", "parameters": {"width_deg": width}}
    changed = day >= CHANGED
    gap = {"rms_deg": 0.2 + 0.01 * day + 1.5 * changed, "floor_deg": 0.2}
    return {"verdict": "explained" if changed else "none", "gap": gap, "causes": [cause] if changed else []}


@pytest.fixture
def page_url(page_bench: FaultBench) -> str:
    """Of a page that is there, before a rig without a fault."""
    page_bench.at_rest()
    page_bench.wait(lambda: page_bench.status()["page"]["pid"], "a page")
    return str(page_bench.status()["page"]["url"])


@pytest.fixture
def page(chromium: Any, page_url: str) -> Iterator[Any]:
    """Opened; no error may appear in its console."""
    context = chromium.new_context(viewport={"width": 1280, "height": 900})
    context.set_default_timeout(1000 * AT_HAND_S)
    page = context.new_page()
    errors: list[str] = []
    page.on("console", lambda line: errors.append(line.text) if line.type == "error" else None)
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto(page_url)
    says(page, "now-viewers", "page")
    yield page
    if page.locator("#give-up").is_visible():
        page.click("#give-up")
        page.wait_for_selector("#take:visible")
    context.close()
    assert errors == []


def says(page: Any, name: str, pattern: str, patience_s: float = PATIENCE_S) -> None:
    """Wait until the element of that id holds such a text, but not for a rig that has faulted meanwhile; the page's
    policy forbids to evaluate anything."""
    from playwright.sync_api import expect

    deadline_s = time.monotonic() + patience_s
    while True:
        try:
            return expect(page.locator(f"#{name}")).to_have_text(re.compile(pattern), timeout=1000 * LOOK_S)
        except AssertionError as error:
            if page.inner_text("#badge-word") == "fault":
                raise AssertionError(f"the rig has faulted: {page.inner_text('#fault')}") from error
            if time.monotonic() > deadline_s:
                raise


def badge(page: Any, word: str) -> None:
    says(page, "badge-word", f"^{word}$")


def armed(page: Any) -> None:
    page.click("#take")
    page.click("#arm:enabled")
    badge(page, "armed")


def part(page: Any, name: str) -> None:
    page.click(f"nav a[href='#{name}']")
    page.wait_for_selector(f"#{name}:visible")


def two_records(bench: FaultBench, page: Any) -> None:
    """Carried out from the page."""
    armed(page)
    part(page, "runs")
    page.select_option("#sweep", "short")
    page.click("#queue-it:enabled")
    says(page, "runs-answer", "^Queued: 2 records")
    bench.wait(lambda: bench.status()["queue"][-1]["done"] == 2, "two records")


def diagnosing(session: Path) -> set[int]:
    """Pids of the processes that were called with this session and have not ended."""
    return {
        process.pid
        for process in psutil.process_iter(["cmdline", "status"])
        if str(session) in (process.info["cmdline"] or []) and process.info["status"] != psutil.STATUS_ZOMBIE
    }


def bring_forward(session: Path) -> bool:
    """The diagnosis of a session, which has stepped back for everybody, is not to wait for them all; whether it has
    come so far, and somebody may do that."""
    with contextlib.suppress(psutil.NoSuchProcess):
        for process in map(psutil.Process, diagnosing(session)):
            if process.nice() > 0:
                with contextlib.suppress(psutil.AccessDenied):
                    process.nice(0)
                return True
    return False


def stopped(bench: FaultBench) -> bool:
    """The status says so, a turn of the daemon's clock after the stop; or that a machine that stood still was first."""
    return bench.wait(bench.fault, "the fault", 5.0) in ("ESTOP", *BY_THE_MACHINE)
