"""Work on a disk that may stand still, from a thread that nobody waits for at the end."""

import asyncio
import contextlib
import threading
from collections.abc import Callable
from typing import Any, TypeVar

T = TypeVar("T")


async def aside(work: Callable[[], T]) -> T:
    """What `work` gives, from a thread that no process waits for at its end, unlike those of the event loop: a disk may
    stand still."""
    loop = asyncio.get_running_loop()
    done: asyncio.Future[T] = loop.create_future()

    def tell(how: Callable[[Any], None], what: Any) -> None:
        if not done.done():
            how(what)

    def carry_out() -> None:
        told: tuple[Callable[[Any], None], Any]
        try:
            told = (done.set_result, work())
        except Exception as error:  # noqa: BLE001 - it is told to who waits for it
            told = (done.set_exception, error)
        with contextlib.suppress(RuntimeError):  # the event loop has ended
            loop.call_soon_threadsafe(tell, *told)

    threading.Thread(target=carry_out, name="aside", daemon=True).start()
    return await done
