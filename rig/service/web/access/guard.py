"""What every request must pass before anything looks at it: the name it was sent to, the page it comes from, who sends
it. And what every answer says to the browser about itself."""

import contextlib
import ipaddress
import socket
from collections.abc import Collection
from http.cookies import CookieError, SimpleCookie
from typing import Any, Final
from urllib.parse import urlsplit

from h11 import LocalProtocolError
from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from rig.service.web.access.visitors import COOKIE, LASTS_S, Guesses, Visitor, Visitors

POLICY: Final = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; "
    "frame-src 'self'; form-action 'self'; frame-ancestors 'none'; base-uri 'none'"
)
"""The browser runs and loads what this server sends as files, and nothing else."""
_ALWAYS: Final = {
    "Content-Security-Policy": POLICY,
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Permissions-Policy": "camera=(), microphone=(), geolocation=()",
    "Cache-Control": "no-store",
}
_READING: Final = ("GET", "HEAD")
_OPEN: Final = ("/login", "/static/")
"""Before somebody has shown the token."""


class VisitorGuard:
    """Around the application. Leaves the visitor in `scope["visitor"]`."""

    def __init__(
        self, app: ASGIApp, visitors: Visitors, guesses: Guesses, names: Collection[str], *, local: bool
    ) -> None:
        self._app, self._visitors, self._guesses, self._local = app, visitors, guesses, local
        self._names = {name.lower() for name in (*names, "localhost", socket.gethostname(), socket.getfqdn())}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Refuse, or pass on."""
        headers = Headers(scope=scope)
        visitor = self._visitor(headers)
        refusal = self._refusal(scope, headers, visitor)
        if refusal is not None:
            await self._refuse(refusal, scope, receive, send)
            return
        new = visitor is None
        scope["visitor"] = visitor or self._visitors.new(trusted=False)
        with contextlib.suppress(LocalProtocolError):  # the rest of the request was no HTTP, and has been answered so
            await self._app(scope, receive, self._with_headers(send, scope, new))

    # what is looked at

    def _refusal(self, scope: Scope, headers: Headers, visitor: Visitor | None) -> Response | None:
        host = headers.get("host", "")
        if not self._is_ours(host):
            return PlainTextResponse(f"{host!a} is not a name of this machine; see `web.names`\n", 421)
        foreign = PlainTextResponse("another site may not do this\n", 403)
        if scope["type"] == "websocket" or scope["method"] not in _READING:
            if not self._is_from_here(headers, host, scope):
                return foreign
        elif _is_foreign_reading(headers):
            return foreign
        if self._local or (visitor is not None and visitor.trusted) or self._shows_token(headers, scope):
            return None
        if scope["path"].startswith(_OPEN):
            return None
        if scope["path"] == "/":
            return RedirectResponse("/login", 303)
        return PlainTextResponse("show the token first, at /login\n", 401)

    def _is_ours(self, host: str) -> bool:
        """An address is what the browser connected to; a name could lead here from anywhere (DNS rebinding), unless it
        is known."""
        try:
            name = urlsplit(f"//{host}").hostname or ""
        except ValueError:
            return False
        try:
            ipaddress.ip_address(name)
        except ValueError:
            return name.lower() in self._names
        return True

    def _is_from_here(self, headers: Headers, host: str, scope: Scope) -> bool:
        """Browsers say which page a request comes from; one that does not must carry the key that only our forms
        have."""
        origin = headers.get("origin")
        if origin is not None:
            try:
                return bool(urlsplit(origin).netloc.lower() == host.lower())
            except ValueError:  # an address that is none, such as http://[::1
                return False
        if headers.get("sec-fetch-site") is not None:
            return headers["sec-fetch-site"] == "same-origin"
        scope["needs_form_key"] = True
        return bool(scope["type"] == "http")

    def _visitor(self, headers: Headers) -> Visitor | None:
        try:
            cookie = SimpleCookie(headers.get("cookie", "")).get(COOKIE)
        except CookieError:
            return None
        return self._visitors.recognised(cookie.value) if cookie is not None else None

    def _shows_token(self, headers: Headers, scope: Scope) -> bool:
        """For programs; a browser never sends it by itself."""
        kind, _, token = headers.get("authorization", "").partition(" ")
        address = address_of(scope)
        if kind.lower() != "bearer" or self._guesses.wait_s(address):
            return False
        if self._visitors.token_fits(token.strip()):
            return True
        self._guesses.wrong(address)
        return False

    # what is said

    async def _refuse(self, response: Response, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 4403})
            return
        await response(scope, receive, self._with_headers(send, scope, False))

    def _with_headers(self, send: Send, scope: Scope, new: bool) -> Send:
        async def sending(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in _ALWAYS.items():
                    headers.setdefault(name, value)
                if new and "set-cookie" not in headers:
                    headers["Set-Cookie"] = cookie_line(self._visitors, scope["visitor"])
            await send(message)

        return sending


def cookie_line(visitors: Visitors, visitor: Visitor) -> str:
    """The `Set-Cookie` for a visitor: for this site only, and not for scripts."""
    return f"{COOKIE}={visitors.cookie(visitor)}; Path=/; Max-Age={LASTS_S}; HttpOnly; SameSite=Strict"


def _is_foreign_reading(headers: Headers) -> bool:
    """A page of another site that embeds or fetches something; following a link to here is no reading."""
    site = headers.get("sec-fetch-site", "none")
    return site not in ("same-origin", "none") and headers.get("sec-fetch-mode") != "navigate"


def address_of(scope: Scope) -> str:
    """Where a request came from."""
    return str((scope.get("client") or ("",))[0])


def visitor_of(scope: Any) -> Visitor:
    """Who sent the request that the guard has passed on."""
    visitor: Visitor = scope["visitor"]
    return visitor
