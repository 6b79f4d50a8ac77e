"""What all tests share."""

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings

settings.register_profile("house", deadline=None, derandomize=True)  # the same examples on every machine, however slow
settings.load_profile("house")

ROOT = Path(__file__).resolve().parent.parent


REAL_PROCESSES = ("contract", "faults", "recovery")
"""Folders whose tests run real processes against the real clock. A machine that stands still for tens of milliseconds, as a busy
virtual one does, spoils what they measure; such a test is run again, and the summary says so (decision 0005)."""


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
    if kept := sys.modules.get("fieldbus_rigs"):
        kept.end_all()


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("rig", "tests in the lab: `pytest -m hardware --rig RIG.yaml`")
    group.addoption("--rig", help="rig's YAML for the hardware tests; without it they never run")
    group.addoption("--allow-motion", action="store_true", help="also run the hardware tests that move the rig")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Tests of one file stay in one process, beside what they share; hardware tests run only when a rig is named."""
    for item in items:
        if not item.get_closest_marker("xdist_group"):
            item.add_marker(pytest.mark.xdist_group(item.location[0]))
        if item.path.parent.name in REAL_PROCESSES or item.get_closest_marker("real_time"):
            item.add_marker(pytest.mark.flaky(reruns=2, reruns_delay=1))
    if config.getoption("--rig"):
        return
    lab = [item for item in items if item.get_closest_marker("hardware")]
    if lab:
        if "hardware" in (config.option.markexpr or "").split():
            raise pytest.UsageError("the hardware tests need --rig RIG.yaml; read docs/how-to/bring_up.md first")
        config.hook.pytest_deselected(items=lab)
        items[:] = [item for item in items if item not in lab]
