"""Real-time measures: each granted or denied with its reason, none of them ends the program. Applied in a process of
its own."""

import json
import subprocess
import sys

import pytest

from rig.realtime import measures
from rig.realtime.measures import Measures

ALL = {"gc_frozen", "timer_slack", "mlock", "cpu_dma_latency", "fifo"}


def applied(code: str) -> dict[str, str]:
    """The report of `apply` in a fresh process, after `code`."""
    lines = ["import json, os, gc, ctypes", "from rig.realtime import measures", code, "print(json.dumps(report))"]
    said = subprocess.run([sys.executable, "-c", "\n".join(lines)], check=True, capture_output=True, text=True)
    report: dict[str, str] = json.loads(said.stdout)
    return report


def test_every_measure_is_reported_and_what_was_granted_holds() -> None:
    report = applied(
        "report = measures.apply(measures.Measures(fifo_priority=1))\n"
        "report['policy'] = str(os.sched_getscheduler(0) == os.SCHED_FIFO)\n"
        "report['collecting'] = str(gc.isenabled())"
    )
    assert set(report) >= ALL
    assert all(what == "granted" or what.startswith("denied: ") for name, what in report.items() if name in ALL)
    assert (report["policy"] == "True") == (report["fifo"] == "granted")
    assert report["collecting"] == "False"


def test_without_permission_they_are_denied_with_the_reason_and_the_program_goes_on() -> None:
    report = applied(
        "def no(*_): raise PermissionError(1, 'Operation not permitted')\n"
        "os.sched_setscheduler = no\n"
        "measures._call = no\n"
        "os.open = no\n"
        "report = measures.apply(measures.Measures(fifo_priority=1))"
    )
    for name in ("fifo", "mlock", "cpu_dma_latency", "timer_slack"):
        assert report[name] == "denied: Operation not permitted"
    reason = "denied: Operation not permitted"
    assert measures.denied(report) == f"fifo {reason}; mlock {reason}"


def test_a_core_that_does_not_exist_is_denied() -> None:
    report = applied("report = measures.apply(measures.Measures(fifo_priority=0, cpu=1023, lock_memory=False))")
    assert report["affinity"].startswith("denied: ")


def test_the_last_core_is_taken_when_there_is_more_than_one() -> None:
    report = applied(
        "cores = sorted(os.sched_getaffinity(0))\n"
        "report = measures.apply(measures.Measures(fifo_priority=0, lock_memory=False))\n"
        "report['on'] = str(sorted(os.sched_getaffinity(0)) == cores[-1:])\n"
        "report['several'] = str(len(cores) > 1)"
    )
    assert ("affinity" in report) == (report["several"] == "True")
    assert report["on"] == "True"


def test_what_was_not_asked_for_is_not_reported() -> None:
    report = applied(
        "report = measures.apply(measures.Measures(fifo_priority=0, lock_memory=False, cpu_dma_latency=False))"
    )
    assert not {"fifo", "mlock", "cpu_dma_latency"} & set(report)


@pytest.mark.parametrize(
    ("report", "missing"),
    [
        ({"fifo": "granted", "mlock": "granted"}, ""),
        ({"fifo": "denied: x", "mlock": "granted"}, "fifo denied: x"),
        ({"fifo": "granted", "mlock": "denied: x", "affinity": "denied: y"}, "mlock denied: x"),
        ({}, ""),
    ],
)
def test_pinning_is_a_nicety_the_rest_is_not(report: dict[str, str], missing: str) -> None:
    assert measures.denied(report) == missing


def test_the_defaults_ask_for_everything() -> None:
    assert Measures() == Measures(fifo_priority=80, cpu=-1, early_us=400, lock_memory=True, cpu_dma_latency=True)
