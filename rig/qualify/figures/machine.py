"""On what figures were measured: processor, system, Python, date, and whether it had other work."""

import os
import platform
import time
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

LOOKED_S = 1.0
"""Time over which it is looked whether the machine has other work. The load average would remember the benchmark
before for minutes."""
_COUNTERS = ("user", "nice", "system", "idle", "iowait", "irq", "softirq", "steal")
"""Of the first line of /proc/stat, in clock ticks (proc(5))."""
_AT_REST = ("idle", "iowait")


def machine() -> dict[str, Any]:
    """This machine today, as `pamrig bench --json` writes it, before anything is measured."""
    model = ""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            model = next((line.split(":", 1)[1].strip() for line in file if line.startswith("model name")), "")
    except OSError:
        pass  # not Linux
    return {
        "date": datetime.now(UTC).date().isoformat(),
        "cpu": model or platform.processor(),
        "cores": os.cpu_count(),
        "system": platform.platform(),
        "python": platform.python_version(),
        "load": round(_busy_processors(Path("/proc/stat")), 1),
    }


def _busy_processors(stat: Path) -> float:
    """How many processors other work keeps busy; the load average where the system does not count."""
    if not stat.exists():
        return os.getloadavg()[0]
    before, begun = worked_s(stat.read_text("utf-8")), time.monotonic()
    time.sleep(LOOKED_S)
    return (worked_s(stat.read_text("utf-8")) - before) / (time.monotonic() - begun)


def worked_s(stat: str) -> float:
    """Seconds that all processors together have worked since the start, by the text of /proc/stat."""
    ticks = dict(zip(_COUNTERS, map(int, stat.splitlines()[0].split()[1:]), strict=False))
    return sum(count for name, count in ticks.items() if name not in _AT_REST) / os.sysconf("SC_CLK_TCK")
