"""A visitor of the page without a browser: requests over real sockets, as a browser would send them."""

import http.client
import json
import re
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import urlsplit


@dataclass
class Visitor:
    """Keeps its cookie, and says where it comes from."""

    url: str
    cookie: str = ""
    headers: dict[str, str] = field(default_factory=dict)

    @property
    def origin(self) -> str:
        return self.url.rstrip("/")

    @property
    def address(self) -> tuple[str, int]:
        parts = urlsplit(self.url)
        return str(parts.hostname), int(parts.port or 80)

    def ask(
        self, path: str, body: dict[str, Any] | None = None, *, patience_s: float = 20.0, **headers: str
    ) -> tuple[int, Any]:
        """Status and answer; with a body it is a POST of this page's own."""
        connection = http.client.HTTPConnection(*self.address, timeout=patience_s)
        own = {"Cookie": self.cookie, "Accept": "application/json"} | self.headers
        if body is not None:
            own |= {"Origin": self.origin, "Content-Type": "application/json"}
        try:
            text = None if body is None else json.dumps(body)
            connection.request("GET" if body is None else "POST", path, text, own | headers)
            answer = connection.getresponse()
            if given := answer.getheader("Set-Cookie"):
                self.cookie = given.partition(";")[0]
            data = answer.read()
        finally:
            connection.close()
        if "json" in (answer.getheader("Content-Type") or ""):
            return answer.status, json.loads(data)
        return answer.status, data.decode(errors="replace")

    def do(self, path: str, **body: Any) -> Any:
        """A command that must be carried out; returns its result."""
        status, answer = self.ask(path, body)
        assert status == 200, answer
        return answer.get("result", answer)

    def come(self) -> str:
        """Open the page; returns its form key."""
        _, page = self.ask("/")
        found = re.search(r'data-form-key="(\w+)"', page)
        assert found, page[:300]
        return found[1]
