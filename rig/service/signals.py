"""The signals that ask a commanding process to end, and who hears them meanwhile."""

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any


def ending_signals() -> list[signal.Signals]:
    """What asks a commanding process to end: Ctrl-C, SIGTERM, and the end of its terminal, unless `nohup` has it
    ignored."""
    hang_up = [] if signal.getsignal(signal.SIGHUP) is signal.SIG_IGN else [signal.SIGHUP]
    return [signal.SIGINT, signal.SIGTERM, *hang_up]


@contextmanager
def own_signals(handler: Callable[[int, Any], None] | signal.Handlers) -> Iterator[None]:
    """Meanwhile `handler` is called with each of `ending_signals`, which end nothing; for the main thread."""
    before = {number: signal.signal(number, handler) for number in ending_signals()}
    try:
        yield
    finally:
        for number, earlier in before.items():
            signal.signal(number, earlier)
