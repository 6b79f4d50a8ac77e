"""One of something stands there without an s."""

import pytest

from rig.counted import counted


@pytest.mark.parametrize(("count", "said"), [(0, "0 records"), (1, "1 record"), (2, "2 records")])
def test_one_is_one(count: int, said: str) -> None:
    assert counted(count, "record") == said
