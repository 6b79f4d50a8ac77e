"""A hunt whose sweeps are jobs of a daemon of real processes: seen in its queue, refused while it is busy, cut short by
a fault of the rig."""

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from rich.text import Text

from rig.app import compose, shipped
from rig.app.gap.hunt.hunting import Hunted, hunt
from rig.app.gap.hunt.options import HuntOptions
from rig.app.gap.hunt.report import hunt_and_tell
from rig.cli.service.status_lines import status_lines
from rig.errors import CheckFailed, StateError
from rig.log.reader import read
from rig.qualify.faults.bench import FaultBench
from rig.service.client import Client

pytest_plugins = "support.rigs.daemon_rig"
pytestmark = pytest.mark.real_time
SESSION = """\
name: first
settle_s: 0.2
zero_s: 0.1
ramp_in_s: 0.3
duration_s: 2.5
ramp_out_s: 0.3
records: [{sine: {frequency_hz: 1.0, amplitude_mpa: 0.1}}]
"""
TRIES = 8
"""A busy machine may miss a tick, and such a record is not valid: the hunt is called again, as its user would. The
record is short, so that one without a miss comes soon."""


class Watcher(Client):
    """Keeps what `pamrig watch` shows of every status that is asked for, and stops the first record in its middle."""

    def __init__(self, socket: Path) -> None:
        super().__init__(socket)
        self.seen: set[str] = set()
        self.stops = 0

    def status(self) -> dict[str, Any]:
        status = super().status()
        self.seen.update(Text.from_markup(line).plain for line in status_lines(status))
        if self.stops and status["record"] and status["record"]["done"] > 0.0:
            self.stops -= 1
            self.estop()
        return status


@pytest.fixture
def watcher(bench: FaultBench, client: Client) -> Iterator[Watcher]:
    with Watcher(bench.socket) as watcher:
        watcher.arm()
        yield watcher


@pytest.fixture
def options(bench: FaultBench, watcher: Watcher, tmp_path: Path) -> HuntOptions:
    (tmp_path / "first.yaml").write_text(SESSION)
    model = shipped.configs() / "models" / "simulated.yaml"
    return HuntOptions(compose.load(bench.rig), model, tmp_path / "hunt", first=tmp_path / "first.yaml", daemon=watcher)


def first_step(bench: FaultBench, watcher: Watcher, options: HuntOptions) -> Hunted:
    """The hunt up to its second sweep."""
    for _ in range(TRIES - 1):
        with suppress(CheckFailed):
            return hunt(options, allowed=lambda step: step.sweep == "step_1.yaml")
        back_to_armed(bench, watcher)
    return hunt(options, allowed=lambda step: step.sweep == "step_1.yaml")


def back_to_armed(bench: FaultBench, watcher: Watcher) -> None:
    """What a user does after a fault, whichever it was: reset, clear the queue, arm."""
    bench.wait(lambda: not watcher.status()["working"], "the queue to hold")
    if watcher.status()["state"] == "fault":
        watcher.reset()
    watcher.clear()
    if watcher.status()["state"] == "disarmed":
        watcher.arm()


def test_a_busy_daemon_is_not_disturbed(bench: FaultBench, watcher: Watcher, options: HuntOptions) -> None:
    watcher.start(bench.sweep)
    told: list[Hunted] = []
    with pytest.raises(StateError, match="works on its queue"):
        hunt_and_tell(options, lambda step: True, lambda step: None, told.append)
    bench.wait(lambda: watcher.status()["state"] == "running", "the sweep to run")
    assert len(told) == 1
    assert not (options.folder / "step_1_records").exists()


def test_cut_short_by_a_fault_it_says_so_and_goes_on_as_a_job_like_any_other(
    bench: FaultBench, watcher: Watcher, options: HuntOptions
) -> None:
    told: list[Hunted] = []
    watcher.stops = 1
    with pytest.raises(CheckFailed, match="step_1"):
        hunt_and_tell(options, lambda step: True, lambda step: None, told.append)
    assert [step.done for step in told[0].hunt.steps] == [False]
    assert told[0].cut_short_by
    watcher.stops = 0  # a machine that stood still may have been quicker
    back_to_armed(bench, watcher)
    found = first_step(bench, watcher, options)
    assert found.hunt.steps[0].done
    assert any(line.startswith("record ") and "s left" in line for line in watcher.seen)
    assert any("step_1: running, 0 of 1 record" in line for line in watcher.seen)
    job = [one for one in watcher.status()["queue"] if one["name"] == "step_1"][-1]
    assert job["state"] == "done"
    (record,) = read(options.folder / found.hunt.steps[0].records)
    assert record.angle_deg is not None
    assert all(Path(file).exists() for file in job["files"]), "the daemon's own file stays"
