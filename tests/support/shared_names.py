"""Names for memory between processes."""

import secrets
from collections.abc import Iterator

from rig.realtime import shared


def unused_name() -> Iterator[str]:
    """A name that nobody else uses; whatever it names is removed. For a fixture."""
    made = f"test-{secrets.token_hex(8)}"
    yield made
    for path in shared.folder().glob(f"pamrig-{made}*"):
        path.unlink()
