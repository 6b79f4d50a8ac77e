"""Where the answering process lives: it may read its question, the program and the system, and write its answer;
nothing else.

Four layers, each of which holds by itself what it can:

    namespaces   a file tree that contains nothing but the given places, and a network without any interface
                 (mount, user, network)
    landlock     the kernel refuses files beyond the given places, other processes, outgoing TCP (Linux 5.13 and later)
    seccomp      the kernel refuses sockets of any kind, signals, reading other processes' memory, changing their
                 limits, leaving marks for the next answer, and undoing the other layers
    audit        the interpreter says the same in Python; alone it stops accidents, not attackers

Whatever a kernel or a container does not offer is left out; `enter` returns the layers that stand, and the result says
which were missing. Nothing of it can be undone from inside. Call it before any thread starts.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from rig.blind_check.sandbox import audit, landlock, namespaces, seccomp
from rig.blind_check.sandbox.places import SYSTEM_PLACES, SYSTEM_WRITABLE, python_places

LAYERS: Final = ("namespaces", "landlock", "seccomp", "audit")


def enter(readable: Sequence[Path], writable: Sequence[Path]) -> list[str]:
    """Shut this process in; returns the names of the layers that stand."""
    readable = [*readable, *python_places(), *SYSTEM_PLACES]
    writable = [*writable, *SYSTEM_WRITABLE]
    layers = [name for name, stands in (
        ("namespaces", namespaces.enter(readable, writable)),
        ("landlock", landlock.enter(readable, writable)),
        ("seccomp", seccomp.enter()),
    ) if stands]  # fmt: skip
    audit.enter(readable, writable)
    return [*layers, "audit"]
