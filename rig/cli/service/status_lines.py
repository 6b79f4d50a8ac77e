"""The status of the daemon as lines for a terminal: shared by `status` and `watch`."""

from collections.abc import Iterator
from typing import Any, Final

from rich.markup import escape

from rig.channels import PNEUMATIC, Channels, channels_of
from rig.number_text import counted
from rig.report.shown_text import in_one_line

COLOURS = {"disarmed": "white", "armed": "yellow", "running": "green", "done": "cyan", "fault": "bold red"}


def status_lines(status: dict[str, Any]) -> Iterator[str]:
    """Rig, state, fault with its hint, what runs, the queue, the loop: with rich's markup."""
    own, status = channels_of(status, "status"), _fit(status)
    colour = COLOURS[status["state"]]
    yield (
        f"{status['rig']}: [{colour}]{status['state'].upper()}[/]   session {status['session'] or '-'}   up "
        f"{status['uptime_s']:.0f} s"
    )
    if fault := status["fault"]:
        yield f"[bold red]{fault['name']}[/]: {fault['cause']}" + (
            f" ({escape(fault['said'])})" if fault["said"] else ""
        )
        yield from safe_lines(status.get("safe_state"), own)
        yield f"  what to do: {fault['hint']}"
        if status.get("black_boxes"):
            yield f"  black box: {status['black_boxes'][-1]}"
    if record := status["record"]:
        yield f"record {record['name']}: {record['done']:.0%}, {record['left_s']:.0f} s left"
    if status["pause_s"] > 0:
        yield f"the muscle rests, {status['pause_s']:.0f} s left"
    yield from queue_lines(status)
    if loop := status["loop"]:
        yield from loop_lines(loop, own)
    yield from dead_lines([name for name, process in status["processes"].items() if not process["alive"]])
    denied = [f"{name} {answer}" for name, answer in status["realtime"].items() if answer != "granted"]
    if denied:
        yield f"[yellow]real-time measures: {'; '.join(denied)}[/]"
    if status.get("recording_error"):
        yield f"[bold red]records cannot be written: {status['recording_error']}[/]"
    free_gb = status["disk_free_gb"]
    yield f"disk {'-' if free_gb is None else f'{free_gb:.1f}'} GB free, logs in {status['logs']}"
    if due := status.get("retention"):
        first_h = due["first_in_s"] / 3600
        yield (
            f"[yellow]retention: {counted(due['announced'], 'record')} will be removed, the first in "
            f"{first_h:.1f} h[/]; the log names them"
        )


def _fit(value: Any) -> Any:
    """Every text in the status as it stands between markup on a terminal: a name's brackets and control codes do
    nothing."""
    if isinstance(value, dict):
        return {key: _fit(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_fit(item) for item in value]
    return escape(in_one_line(value)) if isinstance(value, str) else value


def queue_lines(status: dict[str, Any]) -> Iterator[str]:
    """The jobs that are not over and how long they take, and a last one that failed or holds records that are not
    valid."""
    jobs = status["queue"]
    left = [job for job in jobs if job["state"] in ("waiting", "running", "stopped")]
    over = [job for job in jobs if job not in left]
    for job in [job for job in over[-1:] if job["state"] == "failed" or job.get("not_valid")] + left:
        spoilt = f", {job['not_valid']} not valid" if job.get("not_valid") else ""
        why = f" ({job['error']})" if job["error"] else ""
        done = f"{job['done']} of {counted(job['total'], 'record')}"
        line = f"job {job['id']} {job['name']}: {job['state']}, {done}{spoilt}{why}"
        yield f"[red]{line}[/]" if job["state"] == "failed" or spoilt else line
    if left:
        yield f"{status['left_s']:.0f} s of work left" + ("" if status["working"] else "; held: `pamrig start` goes on")


def safe_lines(report: dict[str, Any] | None, own: Channels = PNEUMATIC) -> Iterator[str]:
    """What is known of the safe state: what was written, by whom, how long ago, and whether the device confirmed it."""
    if report is None:
        return
    colour = "green" if report["confirmed"] else "yellow" if report["safe"] else "bold red"
    ago = report["written_ago_s"]
    written = report["outcome"] in ("written", "seen") and ago is not None
    what = f": {_set_points(report['p1_mpa'], report['p2_mpa'], own)}, {ago:.1f} s ago" if written else ""
    yield f"  [{colour}]{report['words']}{what}[/]"


_MISSED: Final = {
    "loop": "nothing commands or measures the rig",
    "recorder": "nothing is recorded",
    "supervisor": "nobody stands above the loop",
    "guardian": "nobody stands in for the supervisor",
}


def dead_lines(dead: list[str]) -> Iterator[str]:
    """What it means that processes are gone; without the loop the others have nothing to do, and end too."""
    if dead:
        meaning = _MISSED["loop"] if "loop" in dead else ", ".join(_MISSED.get(name, "") for name in dead)
        yield f"[red]not running: {', '.join(dead)}: {meaning}; `pamrig reset` starts them anew, disarmed[/]"


def loop_lines(loop: dict[str, Any], own: Channels = PNEUMATIC) -> Iterator[str]:
    """Set-points, measurements and punctuality."""
    if "tick" in loop:
        age_s = loop.get("age_s") or 0.0
        yield ("" if loop.get("live", True) else f"last seen {age_s:.1f} s ago, not live: ") + (
            _pneumatic_lines(loop) if own.has_valves else _own_lines(loop, own)
        )
    if late := loop["lateness_us"]:
        lateness = ", ".join(f"{name} {late[name]:.0f}" for name in ("p50", "p99", "max"))
        yield f"late {lateness} us; missed {loop['missed']}; ring {loop['ring_fill']:.0%} full"


def _pneumatic_lines(loop: dict[str, Any]) -> str:
    return (
        f"set-points {_set_points(loop['p1_cmd_mpa'], loop['p2_cmd_mpa'], PNEUMATIC)}, "
        f"measured {_number(loop['p1_mpa'])} {_number(loop['p2_mpa'])} MPa, angle "
        f"{_number(loop['angle_deg'], '+7.2f')} deg"
    )


def _own_lines(loop: dict[str, Any], own: Channels) -> str:
    angle = loop["angle_deg"]
    output = None if angle is None else own.own_output(angle)
    wanted = _set_points(loop["p1_cmd_mpa"], loop["p2_cmd_mpa"], own)
    return f"{own.input.spoken} {wanted}, {own.output.spoken} {_number(output, '.4g')} {escape(own.output.unit)}"


def _set_points(p1_mpa: float | None, p2_mpa: float | None, own: Channels) -> str:
    """Both set-points, or the one input of a rig with a channel map."""
    if own.has_valves:
        return f"{_number(p1_mpa)} {_number(p2_mpa)} MPa"
    there = None if p1_mpa is None or p2_mpa is None else own.own_input(p1_mpa - p2_mpa)
    return f"{_number(there, '.4g')} {escape(own.input.unit)}"


def _number(value: float | None, form: str = ".3f") -> str:
    return "-" if value is None else format(value, form)
