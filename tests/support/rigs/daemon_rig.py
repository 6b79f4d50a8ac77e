"""A daemon of real processes, as fixtures for files of tests that share one: with viewers, live view and metrics."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from rig.qualify.faults.attacks import free_port
from rig.qualify.faults.bench import FaultBench
from rig.service.client import Client
from support.rigs.patient_rig import PATIENT

TOKEN = "0123456789abcdef"
SHORT = """\
settle_s: 0.1
zero_s: 0.05
ramp_in_s: 0.1
duration_s: 0.5
ramp_out_s: 0.1
records: [{hold: {amplitude_mpa: [0.05, 0.1]}}]
"""


@pytest.fixture(scope="module")
def ports() -> tuple[int, int]:
    return free_port(), free_port()


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory, ports: tuple[int, int]) -> Iterator[FaultBench]:
    folder = Path(tmp_path_factory.mktemp("daemon"))
    (folder / "token").write_text(TOKEN)
    metrics = folder / "pamrig.prom"
    (folder / "daemon.yaml").write_text(
        f"live: {{port: {ports[0]}}}\nview: {{port: {ports[1]}, token_file: {folder / 'token'}}}\nmetrics: {metrics}\n"
    )
    (folder / "short.yaml").write_text(SHORT)
    with FaultBench(folder, PATIENT, arguments=("--config", str(folder / "daemon.yaml"))) as bench:
        bench.start()
        yield bench


@pytest.fixture
def client(bench: FaultBench) -> Iterator[Client]:
    """Connected to a disarmed daemon with an empty queue."""
    bench.at_rest()
    with bench.client() as client:
        yield client
