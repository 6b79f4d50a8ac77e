"""Work on disks and processes that may stand still, from threads that nobody has to wait for. Each piece has a thread
of its own: those of an event loop are few, and one disk would hold up what is on another."""

import _thread
import asyncio
import contextlib
import logging
import queue
import threading
from collections.abc import Awaitable, Callable
from typing import Any, Final, TypeVar

from rig.errors import RigError

T = TypeVar("T")
END_S: Final = 10.0
"""For a disk to take what was begun, when the daemon ends."""
BEGINS_S: Final = 5.0
"""For a thread to take up its work; one that comes up without memory never does, and nobody tells."""
_SOON_S: Final = 0.2
"""Nobody is told of a wait that is shorter."""
_LOG = logging.getLogger("pamrig")


async def aside(work: Callable[[], T]) -> T:
    """What `work` gives, from a thread that no process waits for at its end, unlike those of the event loop."""
    return await _begun(work)


async def aside_or_here(work: Callable[[], T]) -> T:
    """The same for what has to be done at once: by the event loop's own thread where this machine gives no other."""
    try:
        return await aside(work)
    except NoThread:
        return work()


async def in_any_case(*work: Awaitable[object]) -> None:
    """All of it, at once; what goes wrong with one of them is logged, and stands in the way of nothing that comes after
    it."""
    for error in await asyncio.gather(*work, return_exceptions=True):
        if isinstance(error, Exception):
            _LOG.error("at the end: %r", error)


class NoThread(RigError):
    """This machine gives no thread: so many run already, or there is no memory for another."""


class ReadyThread:
    """A thread for the moment of trouble, at which the machine may give none: it is there before, and waits."""

    def __init__(self) -> None:
        """NoThread when there is none to be had."""
        self.busy = False
        self._works: queue.SimpleQueue[Callable[[], None] | None] = queue.SimpleQueue()
        _begin_thread(self._run)

    def begin(self, work: Callable[[], None]) -> None:
        """Carry it out; not while it is `busy`."""
        self.busy = True
        self._works.put(work)

    def end(self) -> None:
        """Let the thread end, after what it does."""
        self._works.put(None)

    def _run(self) -> None:
        while (work := self._works.get()) is not None:
            try:
                work()
            except Exception:  # noqa: BLE001 - it is to be there for the next attempt
                _LOG.exception("error in pamrig itself, please report it")
            finally:
                self.busy = False


class DiskWork:
    """Pieces of work whose outcome is to be on a disk: each is carried out to its end, whoever waited for it."""

    def __init__(self) -> None:
        self._under_way: set[asyncio.Future[Any]] = set()

    async def do(self, work: Callable[[], T]) -> T:
        """What `work` gives. Who is cancelled meanwhile leaves it to be carried out all the same."""
        return await asyncio.shield(self.begin(work))

    def begin(self, work: Callable[[], T]) -> "asyncio.Future[T]":
        """The same without waiting for it."""
        piece = _begun(work)
        self._under_way.add(piece)
        piece.add_done_callback(self._over)
        return piece

    async def end(self, last: Callable[[], None], say: Callable[[str], None]) -> str:
        """Let what was begun come to its end, and then `last`; returns what became of that, in words, empty when all is
        well. `say` gets a line when it takes a while."""
        if await self._settled(say):
            self.begin(last)
            if await self._settled(say):
                return ""
        return f"a disk did not take within {END_S:g} s what was begun on it: look at the queue and the ledger"

    async def _settled(self, say: Callable[[str], None]) -> bool:
        if self._under_way:
            await asyncio.wait(self._under_way, timeout=_SOON_S)
        if self._under_way:
            say("waiting for the disk: queue, ledger or metrics")
            await asyncio.wait(self._under_way, timeout=END_S)
        return not self._under_way

    def _over(self, piece: "asyncio.Future[Any]") -> None:
        self._under_way.discard(piece)
        if not piece.cancelled():
            piece.exception()  # for who has gone meanwhile: nobody else asks


def _begun(work: Callable[[], T]) -> "asyncio.Future[T]":
    loop = asyncio.get_running_loop()
    done: asyncio.Future[T] = loop.create_future()
    claim = threading.Lock()
    """Who has it carries the work out, or says that nobody will."""

    def tell(how: Callable[[Any], None], what: Any) -> None:
        if not done.done():
            how(what)

    def give_up() -> None:
        if claim.acquire(blocking=False):
            tell(done.set_exception, _no_thread())

    def carry_out() -> None:
        if not claim.acquire(blocking=False):
            return
        answer: tuple[Callable[[Any], None], Any]
        try:
            answer = (done.set_result, work())
        except Exception as error:  # noqa: BLE001 - it is told to who waits for it
            answer = (done.set_exception, error)
        with contextlib.suppress(RuntimeError):  # the event loop has ended
            loop.call_soon_threadsafe(tell, *answer)

    _begin_thread(carry_out)
    loop.call_later(BEGINS_S, give_up)
    return done


def _begin_thread(work: Callable[[], None]) -> None:
    """NoThread when there is none to be had. Not by `threading.Thread`, which waits until the thread has come up: for
    ever, on the event loop, when there is no memory for that."""
    try:
        _thread.start_new_thread(work, ())
    except RuntimeError:
        raise _no_thread() from None


def _no_thread() -> NoThread:
    return NoThread("this machine gives no thread for it; try again")
