"""Ctrl-C is heard while `pamrig` and its packages are imported, wherever it strikes, and after the work is done.
SIGTERM and the end of the terminal are heard as it is. What comes before is in main.py."""

import atexit
import os
import signal
import sys
import threading
import time
from typing import Any, Final

from rig.cli import memory_room

INTERRUPTED: Final = 130
"""Exit status after Ctrl-C: 128 and the number of SIGINT, as shells have it."""
_TOLD_TO_END: Final = (signal.SIGTERM, signal.SIGHUP)
"""What ends a process on the spot unless it listens, with whatever it has half written left behind."""
_SOON_S: Final = 0.01
"""Until Ctrl-C strikes once more where it was not heard, and again as long as it would be lost once more."""


def carry_out_interruptibly(is_heard: bool) -> None:
    """`rig.cli.commands.main`; Ctrl-C, if it `is_heard` at all, while that and its packages are being imported ends as
    quietly as it does later."""
    sys.unraisablehook = _heard_again
    # `nohup` ignores one
    numbers = [number for number in _TOLD_TO_END if signal.getsignal(number) is not signal.SIG_IGN]
    for number in numbers:
        signal.signal(number, _end)
    for number in (signal.SIGINT, *numbers):
        # registered first, it is called last: Python then hands signals back to the system, and one would end what is
        # done
        atexit.register(signal.signal, number, signal.SIG_IGN)
    try:
        try:
            if is_heard:
                signal.signal(signal.SIGINT, signal.default_int_handler)
            from rig.cli.commands import main as carry_out

            carry_out()
        finally:
            # the interpreter takes a while to end, and would end by the signal: without a word, or with a traceback
            for number in (signal.SIGINT, *numbers):
                signal.signal(number, lambda *_: os._exit(INTERRUPTED))
            # where Ctrl-C struck code made from text (dataclasses make some), `python -m` keeps that it was not caught,
            # and ends by the signal, too; the next such code makes it forget (CPython, run_eval_code_obj)
            exec("")
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)
    except MemoryError:  # for the commands' own modules; what a command meets is told by it
        memory_room.say_none()
        sys.exit(2)


def _end(*_: object) -> None:
    """As by Ctrl-C, which every command ends well by. A terminal that closes says so twice: the second time must not
    strike what is being put in order."""
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    raise KeyboardInterrupt


def _heard_again(lost: Any) -> None:
    """Python's hook for an exception that nobody can catch, raised in a destructor or the callback of a weak reference:
    Ctrl-C there would be lost, so it strikes again."""
    if not issubclass(lost.exc_type, KeyboardInterrupt):
        sys.__unraisablehook__(lost)
        return
    threading.Thread(target=_strike, daemon=True).start()


def _strike() -> None:
    """SIGINT for the main thread, when it has left the hook: on a machine that stood still it may be there yet."""
    main_thread = threading.main_thread().ident
    assert main_thread is not None
    while True:
        time.sleep(_SOON_S)
        frame = sys._current_frames().get(main_thread)  # noqa: SLF001 - documented, in spite of its name
        while frame is not None and frame.f_code is not _heard_again.__code__:
            frame = frame.f_back
        if frame is None:
            signal.pthread_kill(main_thread, signal.SIGINT)
            return
