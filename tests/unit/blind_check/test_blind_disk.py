"""A disk that takes nothing while a check writes: said in one line with the file's name, and nothing half is left."""

import resource
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from rig.blind_check.folder import write_json, write_truth
from rig.errors import RecordError


@contextmanager
def no_room() -> Iterator[None]:
    """Files of this process may not grow beyond some bytes: what a full disk is to it."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (16, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.parametrize(
    ("name", "write"),
    [
        ("answer.json", lambda path: write_json(path, {"said": "more than there is room for"})),
        ("truth.npz", lambda path: write_truth(path, {}, {"sine": {"t_s": np.arange(100.0)}}, [])),
    ],
)
def test_it_is_told_by_the_file_that_it_was_for(tmp_path: Path, name: str, write: Callable[[Path], None]) -> None:
    """It was "the system: No space left on device", and half a file lay there."""
    path = tmp_path / "folder" / name
    with no_room(), pytest.raises(RecordError, match=f"{name}: cannot be written: File too large"):
        write(path)
    assert not list(path.parent.iterdir())
    write(path)
    assert list(path.parent.iterdir()) == [path]
