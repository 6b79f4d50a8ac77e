"""A hunt whose sweeps are jobs of the daemon: they run there, their records are kept by the hunt, a busy daemon is left
alone."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from rig.app import compose
from rig.app.gap.hunting import HuntOptions, hunt
from rig.errors import StateError
from rig.log.reader import read
from rig.qualify.faults.bench import FaultBench
from rig.service.client import Client

pytestmark = pytest.mark.xdist_group("real processes")


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[FaultBench]:
    with FaultBench(tmp_path_factory.mktemp("hunt"), arguments=("--clock", "virtual")) as bench:
        bench.start()
        yield bench


def options(bench: FaultBench, folder: Path, client: Client) -> HuntOptions:
    rig = compose.load(bench.folder / "rig.yaml")
    model = compose.configs() / "models" / "simulated.yaml"
    return HuntOptions(rig, model, folder, first=Path("quick"), minutes=0.5, daemon=client)


def test_the_sweeps_are_jobs_and_their_records_are_kept(bench: FaultBench, tmp_path: Path) -> None:
    with bench.client() as client:
        with pytest.raises(StateError):  # arming is a step of its own
            hunt(options(bench, tmp_path / "unarmed", client))
        client.arm()
        found = hunt(options(bench, tmp_path / "hunt", client))
        jobs = [job["name"] for job in client.status()["queue"]]
    assert found.campaign.steps[0].done
    assert len(jobs) == len(found.campaign.steps)
    assert len(read(tmp_path / "hunt" / "step_1_records")) == 1


def test_a_busy_daemon_is_left_alone(bench: FaultBench, tmp_path: Path) -> None:
    sweep = tmp_path / "long.yaml"
    sweep.write_text("duration_s: 1500.0\nrecords: [{sine: {frequency_hz: 0.5, amplitude_mpa: 0.2}}]\n")
    with bench.client() as client:
        if client.status()["state"] == "disarmed":
            client.arm()
        client.start(sweep)
        with pytest.raises(StateError, match="works on its queue"):
            hunt(replace(options(bench, tmp_path / "busy", client), seed=1))
        client.estop()
