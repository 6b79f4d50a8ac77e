"""What all tests share."""

import contextlib
import fcntl
import functools
import gc
import os
import random
import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TypeVar

import pytest
from hypothesis import settings
from support.standstill import NOT_JUDGED_AT_MOST, RERUNS, STANDSTILLS, Standstills, Witness
from support.warm import Warm

# as in the Makefile, for whoever calls pytest himself: each of some thousands of processes would compile the sources
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False
settings.register_profile("house", deadline=None, derandomize=True)  # the same examples on every machine, however slow
settings.load_profile("house")

ROOT = Path(__file__).resolve().parent.parent
CONFIGS = ROOT / "configs"
T = TypeVar("T")

pytest_plugins = ("support.rigs.page_rig", "support.plants.family_plants", "support.plants.begun_hunts")

REAL_PROCESSES = ("faults", "recovery")
"""Folders whose tests run real processes against the real clock. A machine that stands still for tens of milliseconds,
as a busy virtual one does, spoils what they measure; such a test is run again, and the summary says so (decisions
0005, 0426)."""

STEPS_BACK = 15
"""By so much nicer is a worker while its test waits for nothing, so that the one beside it that reads the clock has a
processor at once (decision 0712)."""


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of practice and real records beside the checkout; tests that need it skip where it is absent."""
    folder = ROOT.parent / "shared"
    if not folder.is_dir():
        pytest.skip(f"no folder {folder}: the practice and real records are not part of the project")
    return folder


@pytest.fixture(scope="module", autouse=True)
def _emulated_rigs_end_with_their_file() -> Iterator[None]:
    """The emulated rigs that a file of tests keeps running do not outlive it."""
    yield
    if kept := sys.modules.get("support.rigs.fieldbus_rigs"):
        kept.end_all()


@pytest.fixture(scope="session")
def warm() -> Iterator[Warm]:
    """For commands that need a process, but not one from scratch."""
    with contextlib.closing(Warm()) as warm:
        yield warm


_FAILED = pytest.StashKey[bool]()
_STANDSTILLS = pytest.StashKey[Standstills]()
_NOT_JUDGED = pytest.StashKey[list[str]]()
STOOD_STILL = "the machine stood still, s"
NOT_JUDGED = "not judged: the machine stood still in every attempt that could be excused, last for {:.2f} s"


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> Iterator[None]:
    report: Any = yield
    item.stash[_FAILED] = item.stash.get(_FAILED, False) or report.failed
    seen = item.stash.get(_STANDSTILLS, None)
    if seen is not None and seen.stood:
        report.user_properties.append((STOOD_STILL, seen.longest_s))
    if seen is not None and report.failed and seen.given_up(item.execution_count):  # type: ignore[attr-defined]
        report.outcome = "skipped"
        report.longrepr = (str(item.path), item.location[1] or 0, NOT_JUDGED.format(seen.longest_s))
    return report  # type: ignore[no-any-return]


def not_judged(reporter: Any) -> list[str]:
    """Tests of which nothing can be said, for the machine stood still too often."""
    reason = NOT_JUDGED.partition("{")[0]
    skipped = (report for report in reporter.stats.get("skipped", ()) if isinstance(report.longrepr, tuple))
    return sorted({report.nodeid for report in skipped if report.longrepr[2].startswith(reason)})


def pytest_terminal_summary(terminalreporter: Any) -> None:
    for report in terminalreporter.stats.get("rerun", ()):
        for stood_s in (value for name, value in report.user_properties if name == STOOD_STILL):
            terminalreporter.write_line(f"{report.nodeid}: run again, the machine stood still for {stood_s:.2f} s")
    for name in not_judged(terminalreporter):
        terminalreporter.write_line(f"{name}: not judged")


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Kept, for what comes when all workers have ended."""
    reporter = session.config.pluginmanager.get_plugin("terminalreporter")
    if reporter is not None:
        session.config.stash[_NOT_JUDGED] = not_judged(reporter)


@pytest.hookimpl(wrapper=True)
def pytest_cmdline_main(config: pytest.Config) -> Iterator[None]:
    """What could not be judged has its verdict at the end of the run, by the same rules: one test after the other and
    nothing of ours beside it. Only what cannot be judged there either is left at that, as the last word of the run,
    and where that is too much the run has not passed (decision 0743)."""
    status: Any = yield
    names = config.stash.get(_NOT_JUDGED, [])
    if not names or status not in (pytest.ExitCode.OK, pytest.ExitCode.TESTS_FAILED):
        return status  # type: ignore[no-any-return]
    if config.getoption("--alone"):
        print(f"\n{len(names)} not judged, not even alone: the machine stood still there too:", *names, sep="\n")
        return status or int(len(names) > NOT_JUDGED_AT_MOST)  # type: ignore[no-any-return]
    print(f"\n{len(names)} not judged yet, once more with nothing else on:", flush=True)
    call = [sys.executable, "-m", "pytest", "-q", "--alone", "--rootdir", str(config.rootpath), *names]
    there = subprocess.run(call, cwd=config.rootpath, check=False).returncode
    return status or there  # type: ignore[no-any-return]


@pytest.fixture(autouse=True)
def _modbus_lines_end_with_their_test(
    request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> Iterator[None]:
    """A line left open is closed here, not collected in the middle of a test that has nothing to do with it.

    A test that failed on the way, and is run again, may leave one; one that passed may not, and nor may the driver.
    """
    client: Any = getattr(sys.modules.get("pymodbus.client"), "ModbusTcpClient", None)
    if client is None:
        yield
        return
    opened: list[Any] = []
    connect = client.connect
    monkeypatch.setattr(client, "connect", lambda self: opened.append(self) or connect(self))
    yield
    left = [line for line in opened if line.connected]
    for line in left:
        line.close()
    assert not left or request.node.stash.get(_FAILED, False), "a Modbus line was left open"


@pytest.hookimpl(wrapper=True)
def pytest_collection(session: pytest.Session) -> Iterator[None]:
    """What is imported and collected stays to the end: nobody looks through it for what could be thrown away."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("rig", "tests in the lab: `pytest tests/hardware -m hardware --rig RIG.yaml`")
    group.addoption("--rig", help="rig's YAML for the hardware tests; without it they never run")
    group.addoption("--allow-motion", action="store_true", help="also run the hardware tests that move the rig")
    again = parser.getgroup("again", "tests that could not be judged")
    again.addoption("--alone", action="store_true", help="what is not judged here either is said so, and left at that")
    order = parser.getgroup("order", "tests in another order")
    order.addoption(
        "--shuffle", type=int, metavar="SEED", help="files, and the tests in each, in an order drawn from SEED"
    )


def pytest_report_header(config: pytest.Config) -> str | None:
    seed = config.getoption("--shuffle")
    return None if seed is None else f"in random order: --shuffle {seed}"


def shuffled(items: list[pytest.Item], seed: int) -> list[pytest.Item]:
    """Files in another order, and the tests in each: what a file's tests share is still made once."""
    draw, by_file = random.Random(seed), defaultdict[str, list[pytest.Item]](list)
    for item in items:
        by_file[item.location[0]].append(item)
    files = sorted(by_file)
    draw.shuffle(files)
    for name in files:
        draw.shuffle(by_file[name])
    return [item for name in files for item in by_file[name]]


@functools.cache
def of_real_processes(file: Path) -> bool:
    return any(file.is_relative_to(ROOT / "tests" / room) for room in REAL_PROCESSES)


def reads_the_clock(item: pytest.Item) -> bool:
    """It runs real processes, or against the real clock."""
    return of_real_processes(item.path) or item.get_closest_marker("real_time") is not None


def holds_a_browser(item: Any) -> bool:
    return "chromium" in item.fixturenames


def arranged(clock: list[T], browser: list[T], rest: list[T], workers: int) -> list[T]:
    """Each of several workers begins with a piece as long as the others' (`--dist worksteal`): what reads the clock
    begins the first, what holds a browser the second, for each has a lane of its own."""
    before = max((len(clock) + len(browser) + len(rest)) // workers - len(clock), 0) if workers > 1 else 0
    return [*clock, *rest[:before], *browser, *rest[before:]]


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    if seen := item.stash.get(_STANDSTILLS, None):
        seen.begin()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    """A test that reads the clock has the lane for itself and is watched over. Beside other workers, whoever only
    computes steps back; where it could not come forward again, it stays."""
    if reads_the_clock(item):
        with lane_of(item):
            item.stash[_STANDSTILLS] = Standstills(witness())
            return (yield)
    if "PYTEST_XDIST_WORKER" not in os.environ or not may_come_forward():
        return (yield)
    before = os.getpriority(os.PRIO_PROCESS, 0)
    os.nice(STEPS_BACK)
    try:
        return (yield)
    finally:
        os.setpriority(os.PRIO_PROCESS, 0, before)


@contextlib.contextmanager
def lane_of(item: Any) -> Iterator[None]:
    """One test at a time, of all workers, reads the clock; one more may hold a browser, before a rig that bears
    seconds (decision 0712)."""
    lane = "support/rigs/page_rig.py" if holds_a_browser(item) else "conftest.py"
    with (Path(__file__).parent / lane).open() as locked:
        fcntl.flock(locked, fcntl.LOCK_EX)
        try:
            yield
        finally:
            fcntl.flock(locked, fcntl.LOCK_UN)  # whoever was forked meanwhile has it open yet


def may_run_again(item: Any) -> bool:
    """After an attempt that failed: twice, and when the machine stood still meanwhile (decision 0426)."""
    seen = item.stash[_STANDSTILLS]
    return not seen.failed(item.execution_count) and not seen.given_up(item.execution_count)


@functools.cache
def witness() -> Witness:
    """Of this process of tests."""
    return Witness()


@functools.cache
def may_come_forward() -> bool:
    """Whether a process that has stepped back could take that back."""
    before = os.getpriority(os.PRIO_PROCESS, 0)
    with contextlib.suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, 0, before - 1)
        os.setpriority(os.PRIO_PROCESS, 0, before)
        return True
    return False


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """One worker has all that reads the clock, another what holds a browser (decisions 0712, 0723), each in the order
    that was drawn where one was (decision 0770); hardware tests run only when a rig is named."""
    seed = config.getoption("--shuffle")
    if seed is not None:
        items[:] = shuffled(items, seed)
    browser = [item for item in items if holds_a_browser(item)]
    clock = [item for item in items if reads_the_clock(item) and not holds_a_browser(item)]
    rest = [item for item in items if not (reads_the_clock(item) or holds_a_browser(item))]
    items[:] = arranged(clock, browser, rest, int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1")))
    for item in items:
        if reads_the_clock(item):
            again = functools.partial(may_run_again, item)
            item.add_marker(pytest.mark.flaky(reruns=RERUNS + STANDSTILLS, reruns_delay=1, condition=again))
    if config.getoption("--rig"):
        return
    lab = [item for item in items if item.get_closest_marker("hardware")]
    if lab:
        if "hardware" in (config.option.markexpr or "").split():
            raise pytest.UsageError("the hardware tests need --rig RIG.yaml; read docs/how-to/bring_up.md first")
        config.hook.pytest_deselected(items=lab)
        items[:] = [item for item in items if item not in lab]
