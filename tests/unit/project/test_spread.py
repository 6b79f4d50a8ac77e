"""How `make test` spreads the suite over its workers: a file stays whole, so that what its tests share is made once."""

import os
import re
import subprocess
import sys
from pathlib import Path

from conftest import ROOT, TAKE_LONG

TESTS = """\
import os
from pathlib import Path
import pytest

@pytest.mark.parametrize("number", range(6))
def test_told(number):
    with Path(__file__).with_suffix(".txt").open("a") as workers:
        workers.write(os.environ["PYTEST_XDIST_WORKER"] + "\\n")
"""


def test_a_file_stays_with_one_worker(tmp_path: Path) -> None:
    """By the options of the Makefile: versions of pytest and xdist have been seen that spread groups without a word."""
    found = re.search(r"-m pytest -q -n \$\(WORKERS\) (.+?) \$\(if", (ROOT / "Makefile").read_text())
    assert found
    for name in ("test_one", "test_other"):
        (tmp_path / f"{name}.py").write_text(TESTS)
    call = [sys.executable, "-m", "pytest", "-q", "-n", "2", *found[1].split(), "-p", "no:cacheprovider", str(tmp_path)]
    bare = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST_")}
    done = subprocess.run(call, cwd=tmp_path, env=bare, capture_output=True, text=True, check=False)
    assert "12 passed" in done.stdout, done.stdout + done.stderr
    workers = [(tmp_path / f"{name}.txt").read_text().split() for name in ("test_one", "test_other")]
    assert [len(set(each)) for each in workers] == [1, 1]
    assert workers[0][0] != workers[1][0]


def test_what_is_said_to_take_long_is_there() -> None:
    assert [name for name in TAKE_LONG if not (ROOT / "tests" / name).is_file()] == []
    assert len(set(TAKE_LONG)) == len(TAKE_LONG)
