"""A device that was lost under pressure: who holds its rig without a daemon goes on trying to make it safe, says so,
and ends when it is done, given up, or too long ago."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from rig.app.terminal import say
from rig.realtime.safe_report import NOT_SAFE

TRYING_ON_S: Final = 60.0
"""A plug that is put back, a module or a gateway that starts anew, is there again within a minute. Somebody or a script
waits for the command's end to do something about a rig that is not safe, and is told of no end before."""
ALONE_S: Final = 300.0
"""Where the command itself is gone nobody waits: as long as a switch or a controller takes to start, and no longer, for
who mends something at the rig is not to find muscles filling beside his hands."""
_SAY_S: Final = 10.0
_LOOK_S: Final = 0.05
_BAD: Final = "bold red"
TRIED_ON: Final = (
    f"{NOT_SAFE}: the device does not take the safe state. It is written as soon as it is back, for {ALONE_S:g} s: "
    "keep clear of the joint, or open the dump valve"
)
"""For who cannot be told to end."""


@dataclass(frozen=True)
class TryingOn:
    """`go_on` until the device has taken the safe state."""

    safe_mpa: tuple[float, float]
    given_up: Callable[[], bool]
    """Somebody at the terminal wants it to end."""
    elsewhere: Callable[[], str] = str
    """Who else drives the rig by now, in words: what is written to it then is no longer ours."""
    now_s: Callable[[], float] = time.monotonic
    wait: Callable[[float], None] = time.sleep

    def go_on(self, done: Callable[[], bool], attempt: Callable[[], None]) -> str:
        """Call `attempt` until it is `done`. Returns how it went, for the end of a line that tells of the rig."""
        began_s = said_s = self.now_s()
        p1_mpa, p2_mpa = self.safe_mpa
        say(
            f"{NOT_SAFE}: the device does not take the safe state. It is written as soon as the device is back, "
            f"{p1_mpa:g} and {p2_mpa:g} MPa: keep clear of the joint, or open the dump valve. Tried for "
            f"{TRYING_ON_S:g} s, Ctrl-C gives it up",
            _BAD,
        )
        while True:
            took_s = self.now_s() - began_s
            if done():
                return f", after {took_s:.0f} s of trying"
            if self.given_up():
                return f"; given up by Ctrl-C or a signal after {took_s:.0f} s of trying"
            if other := self.elsewhere():
                return f"; given up after {took_s:.0f} s of trying, for {other}"
            if took_s > TRYING_ON_S:
                return f"; given up after {took_s:.0f} s of trying"
            if self.now_s() - said_s >= _SAY_S:
                said_s = self.now_s()
                left_s = TRYING_ON_S - took_s
                say(f"{NOT_SAFE}: tried for {took_s:.0f} s; for {left_s:.0f} s more, or until Ctrl-C", _BAD)
            attempt()
            self.wait(_LOOK_S)
