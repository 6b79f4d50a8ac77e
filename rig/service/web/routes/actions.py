"""What a visitor may do: stop at any time; command when he holds the command. All of it goes to the daemon, whose word
is the answer."""

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any, Final

from starlette.requests import Request
from starlette.responses import RedirectResponse, Response
from starlette.routing import Route

from rig.errors import RigError, StateError
from rig.service.web.access.bodies import fields, number, text, texts
from rig.service.web.access.command_holder import CommandHolder
from rig.service.web.access.guard import address_of, visitor_of
from rig.service.web.access.visitors import Visitor, Visitors
from rig.service.web.files.catalogue import Catalogue
from rig.service.web.routes.answer import EscapedJson
from rig.service.web.stream.link import DaemonLink

_CONFLICT: Final = 409
_SEEN_S: Final = 0.05
"""After a stop, so that the page which a form leads to shows the fault: the daemon reads the ring every 20 ms."""
Command = Callable[[Request, dict[str, Any]], Awaitable[Any]]


class Actions:
    """Everything but looking."""

    def __init__(
        self,
        link: DaemonLink,
        visitors: Visitors,
        command_holder: CommandHolder,
        sweeps: Catalogue,
        command_holder_changed: Callable[[], None],
        tell: Callable[[dict[str, Any]], None],
    ) -> None:
        self._link, self._visitors, self._command_holder, self._sweeps = link, visitors, command_holder, sweeps
        self._command_holder_changed, self._tell = command_holder_changed, tell

    def routes(self) -> list[Route]:
        """Where each is found; all of them are POST."""
        commands: dict[str, Command] = {
            "arm": self._arm, "start": self._start, "ramp-down": self._ramp_down, "reset": self._reset,
            "clear": self._clear, "mark": self._mark,
        }  # fmt: skip
        routes = [Route(f"/api/{name}", self.command(command), methods=["POST"]) for name, command in commands.items()]
        return [
            Route("/stop", self.stop, methods=["POST"]),
            Route("/api/command/take", self._of_command_holder(self._command_holder.take), methods=["POST"]),
            Route("/api/command/give-up", self._of_command_holder(self._command_holder.give_up), methods=["POST"]),
            *routes,
        ]

    async def stop(self, request: Request) -> Response:
        """The emergency stop, for everybody who may look; by a form it leads back to the page."""
        given = await fields(request, self._visitors)
        try:
            message, status = (await self._link.estop())["words"], 200
        except RigError as error:
            message, status = str(error), 503
        self._tell({"kind": "stopped", "by": visitor_of(request.scope).name, "said": message, "safe": status == 200})
        if "text/html" in request.headers.get("accept", "") or given.get("from") == "form":
            await asyncio.sleep(_SEEN_S)
            return RedirectResponse("/?stopped=" + ("yes" if status == 200 else "no"), 303)
        return EscapedJson({"ok": status == 200, "said": message}, status)

    def command(self, carry_out: Command) -> Callable[[Request], Awaitable[Response]]:
        """A handler for who commands; what the daemon refuses is told in its words."""

        async def handle(request: Request) -> Response:
            given = await fields(request, self._visitors)
            try:
                self._command_holder.require(visitor_of(request.scope))
                return EscapedJson({"ok": True, "result": await carry_out(request, given)})
            except RigError as error:
                return EscapedJson({"ok": False, "error": str(error)}, _CONFLICT)

        return handle

    def _of_command_holder(self, change: Callable[[Visitor], None]) -> Callable[[Request], Awaitable[Response]]:
        async def handle(request: Request) -> Response:
            await fields(request, self._visitors)
            try:
                change(visitor_of(request.scope))
            except StateError as error:
                return EscapedJson({"ok": False, "error": str(error)}, _CONFLICT)
            self._command_holder_changed()
            return EscapedJson({"ok": True, "result": None})

        return handle

    async def _arm(self, request: Request, _: dict[str, Any]) -> Any:
        visitor, address = visitor_of(request.scope), address_of(request.scope)
        return await self._link.call("arm", by=f"browser {visitor.name} at {address}")

    async def _start(self, _: Request, given: dict[str, Any]) -> Any:
        chosen = [self._sweeps.path(name) for name in texts(given, "sweeps")]
        return await self._link.start(chosen, number(given, "pause_s", 0.0), text(given, "before"))

    async def _ramp_down(self, _: Request, given: dict[str, Any]) -> Any:
        return await self._link.call("stop", after_current=given.get("after_current") is True)

    async def _reset(self, _: Request, __: dict[str, Any]) -> Any:
        return await self._link.call("reset")

    async def _clear(self, _: Request, __: dict[str, Any]) -> Any:
        return await self._link.call("clear")

    async def _mark(self, request: Request, given: dict[str, Any]) -> Any:
        marker = text(given, "text")
        result = await self._link.call("mark", text=marker)
        self._tell({"kind": "marker", "text": marker, "by": visitor_of(request.scope).name})
        return result
