"""The few errors of pamrig, each with the moment it is for.

Every message is one line that says what is wrong, where, and what is allowed: the command line prints it as it stands.
Errors of vendors' packages are wrapped at the edge, in the driver that called them.
"""

from typing import TypeVar

E = TypeVar("E", bound=Exception)


def beside(error: E, also: str) -> E:
    """The same error with something else that went wrong at the end of its line."""
    return type(error)(f"{str(error) or 'interrupted'}; {also}")


class RigError(Exception):
    """Anything that a user can put right; ends a command with exit status 2."""


class ConfigError(RigError):
    """A config file is missing, broken, or says something unknown: `rig.yaml: devices.main.kind: 'simulatd' ...`."""


class EnvelopeError(RigError):
    """A sweep would leave the envelope: refused before anything moves, with signal, time and value."""


class RecordError(RigError):
    """A log cannot be read, or does not hold what the command needs."""


class StateError(RigError):
    """A command does not fit the state of the rig, for example `start` while disarmed."""


class LayoutError(StateError):
    """Memory that another version of pamrig made, and that this one would misread."""


class ModelError(RigError):
    """A model file or a parameter set cannot be used: unknown stage, wrong input, diverging."""


class CheckFailed(RigError):
    """The thing asked about is not so (a check that fails, a run that ended in a fault): exit status 1."""


class Interrupted(Exception):
    """The operator ended it, and it ended well: exit status 130 and one line. No RigError: nothing is to be put
    right."""


class DeviceError(RigError):
    """One exchange with a device failed and the next may work: a time-out, a garbled reply. Fills the leaky bucket."""


class DevicePending(DeviceError):
    """The device was told to be safe and has not said yet that it is: it lives, and somebody sees to it. Ask again."""


class WatchdogTripped(DeviceError):
    """Who only looks is refused: the device's own watchdog has most likely acted, and refuses all until it is started
    anew, which whoever opens it to drive does."""


class DeviceLost(DeviceError):
    """The device is gone until somebody acts: port closed, session lost, wrong signature. Faults at once."""
