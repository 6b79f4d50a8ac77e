"""An answer to a browser as JSON, whatever the names and facts in it hold."""

from typing import Any

from starlette.responses import JSONResponse

from rig.service.connections import protocol


class EscapedJson(JSONResponse):
    """A folder may be named in another encoding, and a record hold anything: halves of characters are escaped, numbers
    that JSON lacks become null."""

    def render(self, content: Any) -> bytes:
        """As the daemon's own lines are written."""
        return protocol.as_json(content).encode()
