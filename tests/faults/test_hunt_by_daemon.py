"""A hunt whose sweeps are jobs of a daemon of real processes: seen in its queue, refused while it is busy."""

from pathlib import Path

import pytest

from rig.app import compose
from rig.app.gap.hunting import HuntOptions, hunt, hunt_and_tell
from rig.errors import StateError
from rig.log.reader import read
from rig.qualify.faults.bench import FaultBench
from rig.service.client import Client

pytest_plugins = "daemon_rig"
pytestmark = [pytest.mark.real_time, pytest.mark.xdist_group("real processes")]
SESSION = """\
name: first
settle_s: 0.2
duration_s: 5.0
records: [{sine: {frequency_hz: 1.0, amplitude_mpa: 0.1}}]
"""


@pytest.fixture
def options(bench: FaultBench, client: Client, tmp_path: Path) -> HuntOptions:
    (tmp_path / "first.yaml").write_text(SESSION)
    model = compose.configs() / "models" / "simulated.yaml"
    return HuntOptions(compose.load(bench.rig), model, tmp_path / "hunt", first=tmp_path / "first.yaml", daemon=client)


def test_a_busy_daemon_is_not_disturbed(bench: FaultBench, client: Client, options: HuntOptions) -> None:
    client.arm()
    client.start(bench.sweep)
    told: list[object] = []
    with pytest.raises(StateError, match="works on its queue"):
        hunt_and_tell(options, lambda step: True, lambda step: None, told.append)
    assert client.status()["state"] == "running"
    assert len(told) == 1
    assert not (options.folder / "step_1_records").exists()


def test_a_sweep_of_the_hunt_is_a_job_like_any_other(bench: FaultBench, client: Client, options: HuntOptions) -> None:
    client.arm()
    found = hunt(options, allowed=lambda step: step.sweep == "step_1.yaml")
    (job,) = [one for one in client.status()["queue"] if one["name"] == "first"]
    assert job["state"] == "done"
    assert found.campaign.steps[0].done
    (record,) = read(options.folder / found.campaign.steps[0].records)
    assert record.angle_deg is not None
    assert all(Path(file).exists() for file in job["files"]), "the daemon's own file stays"
