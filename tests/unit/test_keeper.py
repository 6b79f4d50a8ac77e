"""The keeper of one rig before its session is open: a clear answer, not a bug of the daemon."""

import asyncio
from typing import Any, cast

import pytest

from rig.service.keeper import Keeper
from rig.service.protocol import Refused


def test_arm_before_the_rig_is_open_says_to_try_again() -> None:
    keeper = Keeper(cast(Any, None))
    with pytest.raises(Refused, match="still being opened; try again in a second"):
        asyncio.run(keeper.arm())


def test_a_reset_without_a_session_says_to_try_again() -> None:
    keeper = Keeper(cast(Any, None))
    with pytest.raises(Refused, match="still being opened; try again in a second"):
        asyncio.run(keeper.clear_fault())
