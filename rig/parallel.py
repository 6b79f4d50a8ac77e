"""Many independent pieces of work over local processes or a Dask cluster, with progress, surviving lost workers and
kills.

The same code path for both: anything with the interface of concurrent.futures.Executor. Work must be repeatable: a
piece whose worker died is done again, so a piece writes its result whole and under one name.
"""

import ctypes
import os
import signal
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor, Future, InvalidStateError, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from multiprocessing import active_children, get_context
from multiprocessing.process import BaseProcess
from multiprocessing.resource_tracker import ensure_running
from typing import Any, TypeVar

from rig.errors import RigError

R = TypeVar("R")
SCHEDULER_PATIENCE_S = 10.0
"""For a scheduler's first answer."""
MOST_DEATHS = 3
"""So often in a row a worker may die without a piece that gets done."""
GRACE_S = 1.0
"""For a worker that is ended, to take away what it has half written."""
_PR_SET_PDEATHSIG = 1


@contextmanager
def executor(dask: str | None = None, workers: int | None = None) -> Iterator[Executor]:
    """Local processes (one a core unless `workers` says otherwise), or the Dask cluster at `dask`.

    RigError when the cluster cannot be reached or dask is not installed. A cluster's workers must see the same files.
    """
    if dask is None:
        others = active_children()
        with _Local(workers or os.cpu_count() or 1) as pool:
            try:
                yield pool
            except KeyboardInterrupt:
                _end([child for child in active_children() if child not in others])
                raise
        return
    try:
        import distributed
    except ImportError:
        raise RigError("--dask: the package dask.distributed is not installed; pip install 'pamrig[dask]'") from None
    try:
        client: Any = distributed.Client(dask, timeout=SCHEDULER_PATIENCE_S, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise RigError(
            f"--dask {dask}: no scheduler answers there ({type(error).__name__}); expected host:port"
        ) from None
    with client:
        yield client.get_executor(pure=False)


class _Local(Executor):
    """Processes that can be ended in the middle of a piece, which takes away what it has half written; new ones take
    the place of a pool that broke because one of them died."""

    def __init__(self, workers: int) -> None:
        self._workers = workers
        self._pool = self._made()

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> "Future[Any]":
        future = self._pool.submit(_piece, fn, *args, **kwargs)
        future.__class__ = _Cancelled
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        self._pool.shutdown(wait, cancel_futures=cancel_futures)

    def renew(self) -> None:
        self._pool.shutdown()
        self._pool = self._made()

    def _made(self) -> ProcessPoolExecutor:
        _start_tracker()
        return ProcessPoolExecutor(self._workers, get_context("spawn"), _begin_worker, (os.getpid(),))


def _start_tracker() -> None:
    """multiprocessing's own helper, deaf to the end of the terminal as it is to Ctrl-C: ended by that, it is started
    anew for whoever closes what it knows nothing of, with a traceback for each."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGHUP})
    try:
        ensure_running()
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class _Cancelled(Future[Any]):
    """A future that may be cancelled before its pool breaks: in CPython 3.11 the pool's thread fails there, with a
    traceback."""

    def set_exception(self, exception: BaseException | None) -> None:
        with suppress(InvalidStateError):
            super().set_exception(exception)


def _piece(work: Callable[..., R], *args: Any, **kwargs: Any) -> R:
    """A piece of work, in a worker that ends when it is told to."""
    signal.signal(signal.SIGTERM, _told_to_end)
    try:
        return work(*args, **kwargs)
    except _ToldToEnd:
        os._exit(0)
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)


class _ToldToEnd(BaseException):
    """The parent has asked this worker to end; nothing but `_piece` is to catch it."""


def _told_to_end(*_: object) -> None:
    signal.signal(signal.SIGTERM, signal.SIG_IGN)  # the pool tells it again as soon as another worker has gone
    raise _ToldToEnd


def _end(workers: list[BaseProcess]) -> None:
    """End the pieces that are being worked on, which may take minutes; done again, they are whole."""
    for worker in workers:
        worker.terminate()
    until = time.monotonic() + GRACE_S
    for worker in workers:
        worker.join(max(until - time.monotonic(), 0.0))
        worker.kill()  # one that computes in C has not heard of it


def _begin_worker(parent: int) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the parent
    end_with(parent)


def end_with(parent: int) -> None:
    """From now on the kernel ends this process with its parent, which has that pid, however that one ends; at once if
    it is gone. Linux only (prctl(2)); elsewhere this process stays until its work is done."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:
            os.kill(os.getpid(), signal.SIGKILL)


def each(
    pool: Executor, work: Callable[..., R], items: Iterable[Any], done: Callable[[int], None] | None = None
) -> Iterator[R]:
    """`work(item)` for every item, results as they come, in any order; `done(count)` after each. The first failure is
    raised, the rest is cancelled. A piece whose worker died is done again; RigError when workers go on dying."""
    left, count, deaths = dict(enumerate(items)), 0, 0
    total = len(left)
    while left:
        waiting = {pool.submit(work, item): place for place, item in left.items()}
        try:
            for future in as_completed(waiting):
                result = future.result()
                del left[waiting[future]]
                yield result
                count, deaths = count + 1, 0
                if done is not None:
                    done(count)
        except BrokenProcessPool:
            deaths += 1
            if not isinstance(pool, _Local) or deaths >= MOST_DEATHS:
                raise RigError(
                    f"{total - count} of {total} pieces of work are left: their process died {deaths} times in a row "
                    "(killed, or out of memory?)"
                ) from None
            pool.renew()
        except BaseException:
            for future in waiting:
                future.cancel()
            raise
