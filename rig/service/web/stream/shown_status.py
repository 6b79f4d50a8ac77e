"""A status as the page shows it: one badge, what to do, and the few figures that an operator looks at."""

from typing import Any, Final

from rig.channels import channels_of

FRESH_S: Final = 0.8
"""Values older than this are said to be old, so that it is known within a second."""
_JOBS: Final = 30
_BADGES: Final = {
    "disarmed": ("ready", "Disarmed: nothing moves until somebody arms"),
    "armed": ("armed", "Armed: follows Start, nothing moves yet"),
    "running": ("running", "Running: keep hands away"),
    "done": ("armed", "Armed: returning to rest, or at rest between records"),
    "fault": ("fault", "Fault: latched until Reset"),
}
_FIGURES: Final = ("tick", "phase", "p1_cmd_mpa", "p2_cmd_mpa", "p1_mpa", "p2_mpa", "angle_deg", "live", "age_s")


def shown_status(status: dict[str, Any]) -> dict[str, Any]:
    """What of a status goes to every viewer. Texts are as they came: whoever shows them, shows them as text."""
    loop = status["loop"] or {}
    return {
        **badge(status),
        **{
            key: status[key] for key in ("rig", "simulated", "fault", "fault_since_s", "safe_state", "record", "left_s")
        },
        **{key: status[key] for key in ("working", "held", "interrupted", "pause_s")},
        **{key: status[key] for key in ("armed_by", "recording_error", "disk_free_gb")},
        "state": status["state"],
        "loop": {key: loop.get(key) for key in _FIGURES},
        "now": own_now(status),
        "lateness_us": {key: (loop.get("lateness_us") or {}).get(key) for key in ("p50", "p99", "max")},
        "missed": loop.get("missed"),
        "processes": {name: process["alive"] for name, process in status["processes"].items()},
        "denied": [f"{name} {answer}" for name, answer in status["realtime"].items() if answer != "granted"],
        "queue": [_job(job) for job in status["queue"][-_JOBS:]],
        "black_box": (status["black_boxes"] or [None])[-1],
    }


def own_now(status: dict[str, Any]) -> dict[str, float | None]:
    """Input and output as they are, in the rig's own units."""
    own, loop = channels_of(status, "status"), status["loop"] or {}
    p1, p2, angle = (loop.get(name) for name in ("p1_cmd_mpa", "p2_cmd_mpa", "angle_deg"))
    return {
        "input": None if p1 is None or p2 is None else own.own_input(p1 - p2),
        "output": None if angle is None else own.own_output(angle),
    }


def badge(status: dict[str, Any]) -> dict[str, str]:
    """The one word for the rig's state and a sentence."""
    if status["state"] == "running" and status["held"]:
        return {"badge": "stopping", "means": "Stopping: ramps down, then rests"}
    if status["loop"] is None and status["state"] != "fault":
        return {"badge": "opening", "means": "The rig is being opened"}
    word, means = _BADGES[status["state"]]
    return {"badge": word, "means": means}


def no_daemon(why: str) -> dict[str, Any]:
    """What goes to every viewer when the daemon does not answer."""
    return {"badge": "no daemon", "means": "The daemon does not answer: look at the gauges", "why": why}


def _job(job: dict[str, Any]) -> dict[str, Any]:
    kept = ("id", "name", "state", "done", "total", "seconds", "error", "not_valid")
    return {key: job.get(key) for key in kept} | {"folder": job["folder"].rpartition("/")[2]}
