"""What `pamrig watch` shows: the ring it reads, the picture it draws, the keys it takes."""

from collections.abc import Iterator
from typing import Any

import pytest
from rich.console import Console

from rig.channels import PNEUMATIC
from rig.cli.service.watch import WINDOW_S, Window, act, lateness_bars, picture
from rig.errors import RigError
from rig.realtime.ring import Ring, RingWriter
from rig.sample import Sample
from rig.service.session.telemetry import LATENESS_EDGES_US, Telemetry


@pytest.fixture
def ring(request: pytest.FixtureRequest) -> Iterator[Ring]:
    ring = Ring.create(f"test-telemetry-{id(request)}", 1, 64)
    yield ring
    ring.block.unlink()


def put(writer: RingWriter, tick: int, late_us: int = 0, **fields: int) -> None:
    zeros = dict.fromkeys(Sample._fields, 0)
    writer.put(Sample(**(zeros | {"tick": tick, "woken_ns": late_us * 1000} | fields)))


def test_lateness_falls_into_its_class(ring: Ring) -> None:
    telemetry, writer = Telemetry(ring), RingWriter(ring)
    for tick, late_us in enumerate((5, 10, 11, 600, 9000)):
        put(writer, tick, late_us)
    telemetry.update()
    shown = telemetry.lateness()
    classes = dict(zip([*LATENESS_EDGES_US, "above"], shown["histogram"], strict=True))
    assert {edge: count for edge, count in classes.items() if count} == {10: 2, 20: 1, 1000: 1, "above": 1}
    assert shown["max"] == 9000


def test_the_first_sample_of_a_fault_is_kept_until_it_is_cleared(ring: Ring) -> None:
    telemetry, writer = Telemetry(ring), RingWriter(ring)
    for tick, fault in enumerate((0, 6, 6, 6)):
        put(writer, tick, fault=fault)
    telemetry.update()
    assert telemetry.first_fault is not None
    assert telemetry.first_fault.tick == 1
    put(writer, 4)
    telemetry.update()
    assert telemetry.first_fault is None


def test_each_asker_gets_each_sample_once(ring: Ring) -> None:
    telemetry, writer = Telemetry(ring), RingWriter(ring)
    for tick in range(3):
        put(writer, tick)
    telemetry.update()
    cursor, columns = telemetry.columns(0)
    assert columns["tick"] == [0, 1, 2]
    put(writer, 3)
    telemetry.update()
    assert telemetry.columns(cursor)[1]["tick"] == [3]


# the picture


def status(**changed: Any) -> dict[str, Any]:
    loop = {
        "tick": 7, "missed": 2, "ring_fill": 0.01, "p1_cmd_mpa": 0.3, "p2_cmd_mpa": 0.1, "p1_mpa": 0.29, "p2_mpa": None,
        "angle_deg": 12.5,
        "lateness_us": {"p50": 20, "p99": 50, "max": 100, "edges_us": [10, 20], "histogram": [1, 100, 0]},
    }  # fmt: skip
    whole = {
        "rig": "simulated", "state": "running", "session": "ab", "uptime_s": 1.0, "fault": None, "pause_s": 0.0,
        "queue": [], "left_s": 5.0,
        "record": {"name": "sine", "done": 0.5, "left_s": 5.0}, "working": True, "loop": loop, "disk_free_gb": 3.0,
        "logs": "/logs",
        "processes": {"recorder": {"pid": 1, "alive": False}}, "realtime": {"fifo": "denied: no"},
    }  # fmt: skip
    return whole | changed


def empty() -> Window:
    return Window(0.005, PNEUMATIC)


def shown(status: dict[str, Any], window: Window, size: tuple[int, int] = (120, 40)) -> str:
    console = Console(width=size[0], record=True, file=open("/dev/null", "w"))  # noqa: SIM115
    console.print(picture(status, window, size, "note"))
    console.file.close()
    return console.export_text()


def test_the_picture_holds_what_an_operator_needs() -> None:
    fault = {"name": "BROKEN_WIRE", "cause": "a wire is broken", "hint": "check its wire", "said": "monitor 1"}
    text = shown(status(state="fault", fault=fault, black_boxes=["/old.mcap", "/new.mcap"]), empty())
    parts = (
        "FAULT",
        "BROKEN_WIRE: a wire is broken (monitor 1)",
        "what to do: check its wire",
        "black box: /new.mcap",
        "not running: recorder",
        "fifo denied: no",
    )
    parts += (
        "set-points 0.300 0.100",
        "measured 0.290 - MPa",
        "angle  +12.50",
        "missed 2",
        "3.0 GB free",
        "note",
        "emergency stop",
    )
    for part in parts:
        assert part in text


def swept() -> Window:
    window = empty()
    n = 100
    window.add(
        {
            "tick": list(range(n)),
            "p1_cmd_mpa": [0.2 + i / n / 10 for i in range(n)],
            "p2_cmd_mpa": [0.2] * n,
            "angle_deg": [float(i) for i in range(n)],
        }
    )
    return window


def test_a_job_that_failed_is_shown_until_another_is_over() -> None:
    job = {"id": 1, "name": "a", "state": "failed", "done": 0, "total": 1, "error": "a.yaml: no such file"}
    assert "job 1 a: failed, 0 of 1 record (a.yaml: no such file)" in shown(status(queue=[job]), empty())
    assert "failed" not in shown(status(queue=[job, job | {"state": "done", "error": ""}]), empty())


def test_a_finished_job_with_records_that_are_not_valid_says_so() -> None:
    job = {"id": 1, "name": "a", "state": "done", "done": 10, "total": 10, "not_valid": 2, "error": ""}
    assert "job 1 a: done, 10 of 10 records, 2 not valid" in shown(status(queue=[job]), empty())
    assert "job 1" not in shown(status(queue=[job | {"not_valid": 0}]), empty())


def test_the_picture_plots_what_came_in() -> None:
    text = shown(status(), swept())
    assert "angle in degrees over seconds" in text
    assert "angle in degrees over p1 - p2 in MPa" in text


@pytest.mark.parametrize("jobs", [0, 2, 12])
def test_the_picture_fits_a_small_terminal_and_keeps_its_keys(jobs: int) -> None:
    queue = [{"id": n, "name": "paper", "state": "waiting", "done": 0, "total": 15, "error": ""} for n in range(jobs)]
    lines = shown(status(queue=queue), swept(), (80, 24)).rstrip("\n").split("\n")
    assert "emergency stop" in lines[0]
    assert len(lines) <= 24
    assert ("angle in degrees over seconds" in "\n".join(lines)) == (jobs < 12)


def test_the_window_rolls_leaves_gaps_out_and_begins_anew_with_a_session() -> None:
    window = empty()
    ticks = list(range(round(WINDOW_S / 0.005) + 10))
    window.add(
        {
            "tick": ticks,
            "p1_cmd_mpa": [0.2] * len(ticks),
            "p2_cmd_mpa": [0.1] * len(ticks),
            "angle_deg": [None, *[1.0] * (len(ticks) - 1)],
        }
    )
    assert len(window.t_s) == WINDOW_S / 0.005
    window.add({"tick": [1], "p1_cmd_mpa": [0.2], "p2_cmd_mpa": [0.1], "angle_deg": [1.0]})
    assert list(window.t_s) == [0.005]


def test_a_rare_class_of_lateness_does_not_vanish_beside_a_frequent_one() -> None:
    bars = lateness_bars({"edges_us": [10, 20], "histogram": [1000, 1, 0]})
    assert "██▁▁" in bars
    assert lateness_bars({}) == ""


def test_keys_stop_and_stop_at_once_and_errors_are_shown() -> None:
    calls: list[str] = []

    class Daemon:
        def estop(self) -> dict[str, str]:
            calls.append("estop")
            return {"words": "safe state written by the loop"}

        def call(self, command: str, **_: Any) -> dict[str, str]:
            calls.append(command)
            raise RigError("nothing runs")

    daemon: Any = Daemon()
    assert act(daemon, "e") == act(daemon, " ") == "emergency stop: safe state written by the loop"
    assert act(daemon, "s") == "nothing runs"
    assert act(daemon, "x") == ""
    assert calls == ["estop", "estop", "stop"]
