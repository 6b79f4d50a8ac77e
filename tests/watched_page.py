"""The page watched for an hour: does the memory of its server, or of the browser, grow?

    python tests/watched_page.py --minutes 60

A sweep runs again and again under a real daemon; one page looks in Chromium, takes in every row, and draws in every
`--draws`-th minute. A line a minute; status 1 when one of them holds more than a tenth more in the last quarter than in
the one after the plots' ten minutes were full.
"""

import argparse
import json
import statistics
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from support import browsers

from rig.qualify.faults.bench import FaultBench

FULL_MIN = 11
"""The plots keep ten minutes: until then memory has to grow."""
MOST = 1.1


def look(bench: FaultBench, page: Any, session: Any) -> dict[str, float]:
    """Memory as it is now, MB and counts, after the browser has collected its garbage."""
    session.send("HeapProfiler.collectGarbage")
    metrics = {one["name"]: one["value"] for one in session.send("Performance.getMetrics")["metrics"]}
    pid = bench.status()["page"]["pid"]
    rows = page.evaluate("performance.now()")
    return {
        "server_mb": resident_mb(pid),
        "server_files": len(list(Path(f"/proc/{pid}/fd").iterdir())),
        "daemon_mb": resident_mb(bench.daemon_pid),
        "script_mb": metrics["JSHeapUsedSize"] / 1e6,
        "nodes": metrics["Nodes"],
        "listeners": metrics["JSEventListeners"],
        "open_min": rows / 60e3,
    }


def resident_mb(pid: int) -> float:
    """Memory that is a process's own and in use (proc(5), smaps_rollup: private), MB."""
    lines = Path(f"/proc/{pid}/smaps_rollup").read_text(encoding="ascii").splitlines()
    return sum(int(line.split()[1]) for line in lines if line.startswith("Private_")) / 1e3


def watch(minutes: int, draws: int) -> list[dict[str, float]]:
    """One look a minute."""
    seen = []
    with (
        tempfile.TemporaryDirectory() as folder,
        FaultBench(Path(folder), web=True) as bench,
        browsers.started() as browser,
    ):
        bench.start()
        page = browser.new_page(viewport={"width": 900, "height": 700})
        page.goto(bench.status()["page"]["url"])
        session = page.context.new_cdp_session(page)
        session.send("Performance.enable")
        for minute in range(minutes):
            paused = page.get_attribute("#pause", "aria-pressed") == "true"
            if paused is (minute % draws == 0):
                page.click("#pause")
            bench.ready()
            time.sleep(60)
            seen.append(look(bench, page, session))
            print(json.dumps({name: round(value, 2) for name, value in seen[-1].items()}), flush=True)
    return seen


def growth(seen: list[dict[str, float]]) -> dict[str, float]:
    """The last quarter over the first after the plots were full, by name."""
    kept = seen[FULL_MIN:]
    quarter = max(len(kept) // 4, 1)
    names = [name for name in kept[0] if name != "open_min"]

    def middle(looks: list[dict[str, float]], name: str) -> float:
        return statistics.median(one[name] for one in looks)

    return {name: middle(kept[-quarter:], name) / middle(kept[:quarter], name) for name in names}


def main() -> int:
    options = argparse.ArgumentParser(description=(__doc__ or "").partition("\n\n")[0])
    options.add_argument("--minutes", type=int, default=60)
    options.add_argument("--draws", type=int, default=1, help="in every so manieth minute")
    given = options.parse_args()
    if given.minutes < FULL_MIN + 2:
        options.error(f"--minutes: at least {FULL_MIN + 2}")
    grown = growth(watch(given.minutes, given.draws))
    print(json.dumps({name: round(ratio, 3) for name, ratio in grown.items()}))
    return 1 if max(grown.values()) > MOST else 0


if __name__ == "__main__":
    sys.exit(main())
