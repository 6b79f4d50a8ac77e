"""Metrics for Prometheus as a text file (node_exporter's textfile collector). Needs the extra `metrics`; a daemon
without it says so."""

from pathlib import Path
from typing import Any

from rig.errors import RigError
from rig.outputs import OutputKind, check_place
from rig.realtime.state import State


def check_usable(path: Path) -> None:
    """RigError when the extra is not installed, or `path` is something else than a file of metrics."""
    try:
        import prometheus_client  # noqa: F401
    except ModuleNotFoundError:
        raise RigError("metrics: needs the extra `metrics`: pip install 'pamrig[metrics]'") from None
    check_place(path, OutputKind.METRICS)
    if path.exists() and not path.is_file():
        raise RigError(f"{path}: cannot be written: it is not a regular file")  # it would be replaced by one


def write(path: Path, status: dict[str, Any]) -> None:
    """The status as metrics, whole or not at all; RigError when `path` has become something else."""
    check_usable(path)
    from prometheus_client import CollectorRegistry, Gauge, write_to_textfile

    registry = CollectorRegistry()

    def gauge(name: str, text: str, value: float) -> None:
        Gauge(f"pamrig_{name}", text, registry=registry).set(value)

    state = Gauge("pamrig_state", "1 for the state the rig is in", ["state"], registry=registry)
    for each in State:
        state.labels(each.name.lower()).set(status["state"] == each.name.lower())
    gauge("fault_code", "Code of the latched fault, 0: none", status["fault"]["code"] if status["fault"] else 0)
    gauge("disk_free_bytes", "Free space where the logs are", (status["disk_free_gb"] or 0.0) * 1e9)
    gauge(
        "queue_waiting",
        "Sweeps that wait or run",
        sum(job["state"] in ("waiting", "running") for job in status["queue"]),
    )
    gauge("dropped_events", "Events not sent to slow subscribers", status["dropped_events"])
    alive = Gauge("pamrig_process_alive", "1 while the process lives", ["process"], registry=registry)
    for name, process in status["processes"].items():
        alive.labels(name).set(process["alive"])
    loop = status["loop"] or {}
    for key, text in (
        ("ticks", "Ticks seen since the daemon started"),
        ("missed", "Periods the loop skipped"),
        ("ring_fill", "Unread part of the ring"),
    ):
        gauge(f"loop_{key}", text, loop.get(key, 0))
    for quantile, value in (loop.get("lateness_us") or {}).items():
        if quantile in ("p50", "p99", "max"):
            gauge(f"loop_lateness_{quantile}_seconds", "Lateness of the last 20 s", value / 1e6)
    write_to_textfile(str(path), registry)
