"""The lab's own tests are tested: their reading part runs against the emulated myRIO, and none runs unasked."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def pytest_in_the_lab(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *arguments]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)


@pytest.mark.real_time
def test_the_reading_tests_pass_on_the_emulated_rig() -> None:
    done = pytest_in_the_lab(
        "tests/hardware", "-m", "hardware", "-k", "wire or safe", "--rig", "configs/rigs/emulated_myrio.yaml"
    )
    assert done.returncode == 0, done.stdout
    assert "1 passed, 2 skipped" in done.stdout


def test_without_a_rig_they_are_refused_in_one_line() -> None:
    done = pytest_in_the_lab("tests/hardware", "-m", "hardware")
    assert done.returncode == 4
    assert "need --rig RIG.yaml" in done.stderr
