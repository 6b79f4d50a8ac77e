"""The lab's own tests are tested: their reading part runs against the emulated myRIO, and none runs unasked."""

import re
import shlex
import subprocess
import sys

import pytest
from conftest import ROOT

CALLS = re.findall(r"`pytest (.*?)`", (ROOT / "docs" / "how-to" / "bring_up.md").read_text(encoding="utf-8"))


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


def test_the_manual_calls_them_with_and_without_motion() -> None:
    assert ["--allow-motion" in call for call in CALLS] == [False, True]


@pytest.mark.parametrize("call", CALLS)
def test_a_call_of_the_manual_finds_them(call: str) -> None:
    """Where no folder is named pytest takes the rig's YAML for one, and does not know the option before it."""
    words = shlex.split(call.replace("RIG.yaml", "configs/rigs/emulated_myrio.yaml"))
    done = pytest_in_the_lab("--collect-only", *words)
    assert done.returncode == 0, done.stderr
    assert "tests/hardware/test_rig.py::" in done.stdout
