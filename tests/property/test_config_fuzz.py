"""Whatever a config holds, reading it ends soon with a config or one clear line: a few of the thousands that
tests/hostile_configs.py makes."""

import itertools
from pathlib import Path

import hostile_configs
import pytest

COUNT = 60


@pytest.mark.parametrize("seed", [1, 2])
def test_configs_made_against_the_readers(tmp_path: Path, seed: int) -> None:
    done = [read() for _, _, read in itertools.islice(hostile_configs.one(tmp_path, seed), COUNT)]
    assert len(done) == COUNT, "each reading asserts for itself"
