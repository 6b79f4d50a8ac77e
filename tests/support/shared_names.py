"""Names for memory between processes."""

import secrets
from collections.abc import Iterator

from rig.realtime import shared
from rig.realtime.safe_report import SafeBlock


def unused_name() -> Iterator[str]:
    """A name that nobody else uses; whatever it names is removed. For a fixture."""
    made = f"test-{secrets.token_hex(8)}"
    yield made
    for path in shared.folder().glob(f"pamrig-{made}*"):
        path.unlink()


def safe_block(name: str) -> Iterator[SafeBlock]:
    """What those who watch a rig tell each other of its safe state. For a fixture."""
    block = SafeBlock.create(f"{name}-safe", 1)
    yield block
    block.block.unlink()
