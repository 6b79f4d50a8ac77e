"""What a daemon says of requests that do not fit, or that cannot be carried out now."""

from typing import Final

from rig.realtime.commands import Request
from rig.realtime.state import Event, State

UNFIT: Final = {
    (State.DISARMED, Event.START): "cannot start while disarmed; run `pamrig arm` first",
    (State.DISARMED, Event.DISARM): "nothing to stop: nothing runs, and the rig is disarmed",
    (State.ARMED, Event.ARM): "armed already; `pamrig start` begins, `pamrig stop` disarms",
    (State.RUNNING, Event.ARM): "armed already, and running; `pamrig stop` ramps down",
}
"""What to say of a command that does not fit, in the operator's words instead of the table's."""
NOT_OPEN: Final = "the rig is still being opened; try again in a second"
BY_HAND: Final = "open the dump valve, then look at cable and power of the device"
NOT_READY: Final = {
    Request.ARM: "cannot arm: the pressures are not known (read error, broken wire, implausible value); see `pamrig "
    "watch`",
    Request.RESET: "the cause is not gone yet (read error, broken wire, or the safe state is not written); see "
    "`pamrig watch`",
}
