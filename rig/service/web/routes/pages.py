"""The HTML: the page itself, whole without scripts as far as state and Stop go, and the one that asks for the token."""

import asyncio
from collections.abc import Awaitable, Callable
from importlib.resources import files
from typing import Any, Final

import jinja2
from starlette.requests import Request
from starlette.responses import HTMLResponse, RedirectResponse, Response

from rig.service.web.access.bodies import fields, text
from rig.service.web.access.guard import address_of, cookie_line, visitor_of
from rig.service.web.access.visitors import Guesses, Visitors
from rig.service.web.routes.answer import EscapedJson

_GUESS_S: Final = 0.5
"""Before a wrong token is answered."""


class Pages:
    """What is drawn on the server."""

    def __init__(
        self,
        visitors: Visitors,
        guesses: Guesses,
        look: Callable[[], Awaitable[None]],
        shown: Callable[[], dict[str, Any]],
        units: dict[str, Any],
    ) -> None:
        """`look` asks the daemon anew, `shown` is what is known, `units` what input and output are called."""
        self._visitors, self._guesses, self._look, self._shown = visitors, guesses, look, shown
        self._units = units
        self._environment = jinja2.Environment(
            autoescape=True, undefined=jinja2.ChainableUndefined, trim_blocks=True, lstrip_blocks=True
        )

    async def front(self, request: Request) -> Response:
        """The page, with the state as it is now: without scripts there is no other."""
        await self._look()
        visitor = visitor_of(request.scope)
        return self._page(
            "page.html.jinja", shown=self._shown(), me=visitor.name, form_key=self._visitors.form_key(visitor),
            stopped=request.query_params.get("stopped"), units=self._units,
        )  # fmt: skip

    async def status(self, _: Request) -> Response:
        """The same as data."""
        await self._look()
        return EscapedJson(self._shown())

    async def login(self, request: Request) -> Response:
        """Ask for the token, or take it."""
        if request.method == "GET":
            return self._asking("", 200)
        given = await fields(request, self._visitors)
        address = address_of(request.scope)
        if (wait_s := self._guesses.wait_s(address)) > 0:
            return self._asking(f"Too many wrong tokens: wait {wait_s:.0f} s.", 429)
        if not self._visitors.token_fits(text(given, "token").strip()):
            self._guesses.wrong(address)
            await asyncio.sleep(_GUESS_S)
            return self._asking("This is not the token.", 403)
        known = RedirectResponse("/", 303)
        known.headers["Set-Cookie"] = cookie_line(self._visitors, self._visitors.new(trusted=True))
        return known

    def _asking(self, problem: str, status: int) -> Response:
        return self._page("login.html.jinja", status, problem=problem)

    def _page(self, name: str, status: int = 200, **shown: Any) -> Response:
        template = files("rig.service.web").joinpath(name).read_text(encoding="utf-8")
        return HTMLResponse(self._environment.from_string(template).render(**shown), status)
