"""Markers into the log of the record that runs: in their order, and no more at a time than a recorder keeps up with."""

import asyncio
import threading
from types import SimpleNamespace
from typing import Any, cast

import pytest

from rig.service.connections.protocol import Refused
from rig.service.records.recorder_messages import Mark
from rig.service.session.marks import MOST_MARKS, MarkWriter


def test_a_recorder_that_stands_still_is_given_so_many_and_all_of_them_later() -> None:
    goes_on, written = threading.Event(), list[str]()

    def expect(mark: Mark) -> None:
        assert goes_on.wait(30.0)
        written.append(mark.text)

    session = cast(Any, SimpleNamespace(recording=SimpleNamespace(expect=expect)))
    writer = MarkWriter()

    async def many() -> None:
        texts = [f"mark {number}" for number in range(MOST_MARKS)]
        waiting = [asyncio.create_task(writer.write(session, text)) for text in texts]
        await asyncio.sleep(0)  # each has begun to wait
        with pytest.raises(Refused, match="does not keep up"):
            await writer.write(session, "one too many")
        goes_on.set()
        await asyncio.gather(*waiting)
        assert written == texts
        await writer.write(session, "after them")
        assert written[-1] == "after them"

    try:
        asyncio.run(many())
    finally:
        goes_on.set()
        writer.executor.shutdown()
