"""A mailbox of an I/O process that is nobody else's."""

from pathlib import Path

from drivers.io_process.mailbox import IoMailbox, create


def own_mailbox(folder: Path) -> IoMailbox:
    """A fresh one, in a file of the folder."""
    descriptor = create(folder / "box")
    assert descriptor is not None
    return IoMailbox(descriptor)
