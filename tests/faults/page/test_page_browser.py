"""The operator's page in a real browser: every flow from arming to a record compared with another, and to what the
days say; who commands and who looks."""

import os
import signal
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import pytest
from support import browsers
from support.rigs.page_rig import (
    CHANGED,
    DAYS,
    MARKUP,
    REFERENCE,
    armed,
    badge,
    bring_forward,
    part,
    says,
    stopped,
    two_records,
)

from rig.app import compose
from rig.app.runs.sweeping import SweepOptions, run_sweep
from rig.qualify.faults.bench import FaultBench

sync_api = pytest.importorskip("playwright.sync_api")


def test_arm_preview_start_watch_mark_and_stop(page_bench: FaultBench, page: Any) -> None:
    armed(page)
    assert "browser" in page.inner_text("#now-armed")
    part(page, "runs")
    page.select_option("#sweep", "long")
    says(page, "preview-said", "fits")
    assert page.inner_text("#preview-records") == "1"
    assert page.inner_text("#preview-seconds") == "1 min 0 s"
    page.fill("#pause-s", "zwei")
    assert "1,5" in page.inner_text("#pause-said")
    assert page.is_disabled("#queue-it")
    page.fill("#pause-s", "1,5")
    assert page_bench.status()["state"] == "armed"  # nothing has moved so far
    page.click("#queue-it:enabled")
    badge(page, "running")
    says(page, "runs-answer", "^Queued: 1 record,")
    assert page_bench.status()["queue"][-1]["pause_s"] == 1.5
    part(page, "rig")
    page_bench.wait(lambda: page_bench.status()["loop"]["phase"] == "sweep", "the sweep")
    page.fill("#mark-text", f"here it {MARKUP} squeaked")
    page.click("#mark button")
    says(page, "answer", "^Marked.$")
    says(page, "rate", r"^(\d\d|[5-9])(\.\d)? frames")
    page.click("#stop-button")
    says(page, "stop-said", "^Stopped")
    assert page_bench.is_safe
    badge(page, "fault")
    assert stopped(page_bench)
    assert page.inner_text("#fault-hint")
    assert "ago" in page.inner_text("#fault-time")
    page.click("#reset:enabled")
    badge(page, "ready")
    assert page.inner_text("#stop-said") == ""  # it was of that fault
    part(page, "records")
    page.locator("#record-list button").first.click()
    says(page, "record-lines", f"marker: here it {MARKUP} squeaked")


def test_records_with_plots_check_and_comparison(page_bench: FaultBench, page: Any) -> None:
    two_records(page_bench, page)
    newest = max(page_bench.logs.iterdir(), key=lambda folder: folder.stat().st_mtime_ns)
    (newest / f"{MARKUP}.mcap").write_bytes(b"no record at all")
    part(page, "records")
    assert page.is_hidden("#record-seen")
    page.locator("#record-list tr").nth(2).wait_for()
    assert "✖ cannot be read" in page.inner_text("#record-list")
    assert page.locator("#record-list img").count() == 0  # a name is text, whatever stands in it
    first, second = page.locator("#record-list button", has_text="sine").all()[:2]
    first.click()
    says(page, "record-said", "missed")
    assert "phase sweep" in page.inner_text("#record-lines")
    page.click("#record-check")
    says(page, "record-said", f"whole and true|{MISSED}")
    with page.expect_download() as download:
        page.click("#record-file")
    assert Path(download.value.path()).read_bytes().startswith(b"\x89MCAP0")
    page.click("#record-keep")
    second.click()
    says(page, "compare-said", "deg rms")
    assert all(drawn(page, f"plot-record-{name}") for name in ("pressure", "angle", "difference", "loop"))
    assert browsers.violations(page) == []
    page.click("#record-keep")
    page.locator("#record-list button", has_text="img").click()
    says(page, "record-said", "cannot be shown")
    assert page.title() != "hit"


DIAGNOSED_S = 600.0
"""A diagnosis has everybody else go first; where it may not be brought forward, that takes as long as they do."""
MISSED = r"^✖ \d+ ticks were missed[^✖]*$"
"""All that is wrong with a record during which the machine stood still."""


def drawn(page: Any, name: str) -> bool:
    """There is more than one colour on the plot."""
    return bool(page.eval_on_selector(f"#{name} canvas", _COLOURS) > 2)


_COLOURS = """canvas => {
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  return new Set(new Uint32Array(data.buffer)).size;
}"""


def test_nothing_starts_by_itself_after_a_reload_or_a_reconnect(page_bench: FaultBench, page: Any) -> None:
    with page_bench.client() as client:
        client.arm()
        client.start(page_bench.sweep)
        client.stop()
        page_bench.wait(lambda: client.status()["state"] in ("done", "disarmed"), "the end of the ramp")
        if client.status()["state"] == "done":
            client.stop()
        assert client.status()["left_s"] > 0  # what was stopped waits
    armed(page)
    page.reload()
    badge(page, "armed")
    assert "You command" in page.inner_text("#commander")
    before = page_bench.status()["page"]["restarts"]
    os.kill(page_bench.status()["page"]["pid"], signal.SIGKILL)
    says(page, "commander", "^Nobody")
    assert page_bench.status()["page"]["restarts"] == before + 1
    assert page_bench.status()["state"] == "armed"
    with page_bench.client() as client:
        client.stop()
    badge(page, "ready")


def test_many_look_and_one_commands(chromium: Any, page_bench: FaultBench, page: Any, page_url: str) -> None:
    armed(page)
    contexts = [chromium.new_context(viewport={"width": 500, "height": 400}) for _ in range(3)]
    try:
        others = [context.new_page() for context in contexts]
        for other in others:
            other.goto(page_url)
            says(other, "commander", "you look on")
            assert all(other.is_disabled(f"#{step}") for step in ("take", "arm", "start", "ramp-down", "reset"))
            assert other.is_enabled("#stop-button")
        says(page, "now-viewers", "^4 pages")
        page.click("#give-up")
        others[1].click("#take:enabled")
        says(page, "commander", "you look on")
        says(others[2], "commander", "you look on")
        others[2].click("#stop-button")
        says(page, "stop-said", "Stopped by browser")
        assert stopped(page_bench)
        others[1].click("#reset:enabled")
        badge(page, "ready")
        others[1].click("#give-up")
        page.wait_for_selector("#take:enabled")
    finally:
        for context in contexts:
            context.close()


def test_a_diagnosis_with_its_report_and_a_place_in_the_history(page_bench: FaultBench, page: Any) -> None:
    session = Path(mkdtemp(prefix="to diagnose ", dir=page_bench.logs))
    options = SweepOptions(session, virtual=True, seed=1)
    run_sweep(page_bench.folder / "short.yaml", compose.load(None), options).judge()
    page.click("#take")
    part(page, "diagnosis")
    page.select_option("#diagnose-session", session.name)
    page.select_option("#diagnose-reference", "simulator")
    page.click("#diagnose-begin:enabled", timeout=1000 * DIAGNOSED_S)  # an earlier one may be at work
    page_bench.wait(lambda: bring_forward(session), "the diagnosis", DIAGNOSED_S)
    says(page, "diagnose-answer", r"^Done\.$", DIAGNOSED_S)
    report = page.frame_locator("#report")
    sync_api.expect(report.locator("h1")).to_contain_text("simulator")
    assert "simulator" not in page.inner_text("#diagnoses td:nth-child(3) >> nth=0")
    assert page.locator("#diagnoses button").count() > DAYS
    assert browsers.violations(page) == []


def test_gap_and_causes_over_the_days_and_the_steps_of_hunts(page_bench: FaultBench, page: Any) -> None:
    part(page, "diagnosis")
    page.select_option("#diagnose-reference", REFERENCE)
    says(page, "history-said", f"the gap went from .* on day {CHANGED:02d}", DIAGNOSED_S)  # read by one who steps back
    says(page, "history-said", f"backlash, named since day {CHANGED:02d}")
    assert page.locator("#history-sizes [role=img]").get_attribute("aria-label").startswith("Size of backlash")
    assert drawn(page, "plot-history")
    assert drawn(page, "history-sizes")
    assert "hunt_a: named" in page.inner_text("#hunts")
    assert "hunt_b: goes on" in page.inner_text("#hunts")
    assert "still possible: delay 55 %, valve_lag 40 %" in page.inner_text("#hunts")
    assert "not run yet" in page.inner_text("#hunts")
    assert page.locator("#hunts img").count() == 0
    assert browsers.violations(page) == []
    page.locator("#diagnoses button").last.click()
    sync_api.expect(page.frame_locator("#report").locator("h1")).to_have_text("Report of day 0")
    page.frame_locator("#report").locator("h1").click()  # the keyboard is in the report now
    page.keyboard.press("Escape")
    says(page, "stop-said", "^Stopped")
    assert stopped(page_bench)


def test_bring_up_says_what_is_next_and_keeps_what_was_confirmed(page_bench: FaultBench, page: Any) -> None:
    page.click("#take")
    part(page, "bringup")
    says(page, "bringup-next", "^Next: 0. On paper")
    assert "pamrig devices probe" in page.inner_text("#bringup-steps")
    assert "seen: the loop reads pressures and angle" in page.inner_text("#bringup-steps")
    page.get_by_role("button", name="Done: 0. On paper", exact=True).click()
    says(page, "bringup-next", "^Next: [12]")
    page.reload()
    says(page, "bringup-next", "^Next: [12]")
    page.get_by_role("button", name="Not done: 0. On paper").click()
    says(page, "bringup-next", "^Next: 0")


def test_a_sweep_from_arming_to_stop_by_the_keyboard_alone(page_bench: FaultBench, page: Any) -> None:
    for name in ("take", "arm"):
        tab_to(page, name)
        page.keyboard.press("Enter")
    badge(page, "armed")
    tab_to(page, "", "#runs", back=True)
    page.keyboard.press("Enter")
    page.locator("#sweep option[value=long]").wait_for(state="attached")
    tab_to(page, "sweep")
    page.keyboard.type("long")
    says(page, "preview-seconds", "1 min 0 s")
    tab_to(page, "queue-it")
    page.keyboard.press("Space")
    badge(page, "running")
    page.keyboard.press("Escape")
    says(page, "stop-said", "^Stopped")
    assert stopped(page_bench)


def test_a_stop_that_is_refused_for_want_of_a_login_is_told_as_that(chromium: Any, page_url: str) -> None:
    """It was sent again for 20 s, and then "nobody answers" was said."""
    context = chromium.new_context()  # of its own: a browser writes of every refusal into its console
    page = context.new_page()
    page.route("**/stop", lambda route: route.fulfill(status=401, body="show the token first, at /login\n"))
    page.goto(page_url)
    says(page, "now-viewers", "page")
    page.click("#stop-button")
    says(page, "stop-said", "^NOT CONFIRMED: this page is not logged in any more")
    context.close()


def tab_to(page: Any, wanted: str, address: str = "", *, back: bool = False) -> None:
    """As somebody would who has no mouse: on to the next that takes the keyboard, which shows that it has it."""
    page.wait_for_selector(f"#{wanted}:enabled" if wanted else f"a[href='{address}']")
    for _ in range(60):
        page.keyboard.press("Shift+Tab" if back else "Tab")
        here = page.evaluate("[document.activeElement.id, document.activeElement.getAttribute('href')]")
        if here == [wanted or here[0], address or here[1]]:
            assert page.evaluate("getComputedStyle(document.activeElement).outlineStyle") != "none"
            return
    raise AssertionError(f"the Tab key never comes to {wanted or address}")
