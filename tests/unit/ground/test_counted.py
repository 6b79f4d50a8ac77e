"""One of something stands there without an s."""

import pytest

from rig.counted import counted


@pytest.mark.parametrize(("count", "said"), [(0, "0 records"), (1, "1 record"), (2, "2 records")])
def test_one_is_one(count: int, said: str) -> None:
    assert counted(count, "record") == said


@pytest.mark.parametrize(("count", "said"), [(0, "0 ticks were"), (1, "1 tick was"), (2, "2 ticks were")])
def test_a_verb_goes_with_it(count: int, said: str) -> None:
    assert counted(count, "tick was", "ticks were") == said
