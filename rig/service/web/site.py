"""The page's application: its parts, its routes, and what comes from the daemon."""

import contextlib
import os
import time
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any, Final

from starlette.applications import Starlette
from starlette.responses import Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles

from rig.errors import RigError
from rig.model.chain import Chain
from rig.model.parameters import load_model
from rig.service.connections.socket_access import user_name
from rig.service.web.access.command_holder import CommandHolder
from rig.service.web.access.guard import VisitorGuard
from rig.service.web.access.peers import may_come, owner_of
from rig.service.web.access.visitors import Guesses, Visitors
from rig.service.web.files.bringup import BringUp
from rig.service.web.files.catalogue import Catalogue
from rig.service.web.files.diagnoses import Diagnoses
from rig.service.web.files.records import SessionFolders
from rig.service.web.page_setup import PageSetup
from rig.service.web.routes.actions import Actions
from rig.service.web.routes.library import LibraryRoutes
from rig.service.web.routes.pages import Pages
from rig.service.web.routes.studies import Studies
from rig.service.web.stream.feed import Feed
from rig.service.web.stream.link import DaemonLink
from rig.service.web.stream.shown_status import FRESH_S, no_daemon, shown_status
from rig.service.web.stream.viewers import Viewers
from rig.service.web.units import units_of
from rig.service.web.worker import PageWorker

STATIC: Final = Path(__file__).parent / "static"
_STATUS_EVERY_S: Final = 0.2


class _Static(StaticFiles):
    """Files that may be kept by the browser once it has asked whether they are still the same."""

    def file_response(self, *given: Any, **named: Any) -> Response:
        response = super().file_response(*given, **named)
        response.headers["Cache-Control"] = "no-cache"
        return response


class Site:
    """One page of one daemon."""

    def __init__(self, setup: PageSetup) -> None:
        self._setup = setup
        self._feed = _feed(setup)
        self._sweeps = Catalogue("sweep", setup.sweeps)
        self._visitors, self._guesses, self._command_holder = (
            Visitors(setup.key, setup.token, lambda: setup.epoch_s + time.monotonic()),
            Guesses(),
            CommandHolder(),
        )
        self._link = DaemonLink(setup.socket, self._hear)
        self._viewers = Viewers(self._command_holder, self._first, self._link.watched)
        self._shown = no_daemon("not heard of the daemon yet")
        self._told_s = 0.0
        self.app = VisitorGuard(self._routes(), self._visitors, self._guesses, setup.names, local=setup.local)

    def admits(self, peer: tuple[Any, ...], here: tuple[Any, ...]) -> str:
        """Why somebody may not connect; empty when he may. On this machine the kernel knows who it is."""
        if not self._setup.local or may_come(owner_of(peer, here), self._setup.group):
            return ""
        return f"this page is for the daemon's own user {user_name(os.getuid())}, root and the members of its group"

    @contextlib.asynccontextmanager
    async def following(self) -> AsyncIterator[None]:
        """While the server runs: listen to the daemon."""
        self._link.follow()
        yield

    def _routes(self) -> Starlette:
        units = units_of(self._setup.rig.channels)
        pages = Pages(self._visitors, self._guesses, self._look, lambda: self._shown, units)
        actions = Actions(
            self._link,
            self._visitors,
            self._command_holder,
            self._sweeps,
            self._tell_command_holder,
            self._viewers.tell,
        )
        records, setup = SessionFolders(self._setup.logs), self._setup
        worker = PageWorker()
        library = LibraryRoutes(setup.rig, self._sweeps, records, worker)
        diagnoses = Diagnoses(setup.state / "diagnoses")
        bringup = BringUp(setup.rig, setup.state / "bringup.json")
        models = Catalogue("model", setup.models)
        studies = Studies(diagnoses, bringup, records, models, worker, lambda: self._shown)
        return Starlette(
            routes=[
                Route("/", pages.front),
                Route("/login", pages.login, methods=["GET", "POST"]),
                Route("/api/status", pages.status),
                WebSocketRoute("/live", self._viewers.serve),
                *actions.routes(),
                *library.routes(),
                *studies.routes(actions),
                Mount("/static", _Static(directory=STATIC)),
            ]
        )

    # from the daemon to the viewers

    async def _look(self) -> None:
        """Ask the daemon now, but not for long: what was heard last stands then."""
        with contextlib.suppress(RigError, TimeoutError):
            self._shown = self._with_command_holder(shown_status(await self._link.status()))

    def _hear(self, status: dict[str, Any] | None, why: str) -> None:
        if status is None:
            self._shown = self._with_command_holder(no_daemon(why))
            self._viewers.tell({"kind": "status", **self._shown})
            return
        news = self._feed.add(samples) if (samples := status.get("samples")) else None
        if news is not None and news.begins:
            self._viewers.tell({"kind": "anew"})
        if news is not None and news.fine:
            self._viewers.tell({"kind": "rows", "fine": news.fine, "coarse": news.coarse})
        now_s = time.monotonic()
        changed = (status["state"], status["held"]) != (self._shown.get("state"), self._shown.get("held"))
        if changed or now_s - self._told_s >= _STATUS_EVERY_S:
            self._told_s = now_s
            self._shown = self._with_command_holder(shown_status(status))
            self._viewers.tell({"kind": "status", **self._shown})

    def _with_command_holder(self, shown: dict[str, Any]) -> dict[str, Any]:
        holder = self._command_holder.holder
        return {**shown, "commander": holder.name if holder is not None else None, "viewers": len(self._viewers)}

    def _tell_command_holder(self) -> None:
        self._shown = self._with_command_holder(self._shown)
        self._viewers.tell({"kind": "status", **self._shown})

    def _first(self) -> list[dict[str, Any]]:
        """What a new viewer has to know."""
        history = {"fine": list(self._feed.fine), "coarse": list(self._feed.coarse)}
        hello = {"kind": "hello", "fresh_s": FRESH_S, "simulator": bool(self._feed.simulates), **history}
        return [hello, {"kind": "status", **self._with_command_holder(self._shown)}]


def _feed(setup: PageSetup) -> Feed:
    """With the simulator, when there is one that can be read."""
    period_s, own = setup.rig.period_ns / 1e9, setup.rig.channels
    if setup.simulator is None:
        return Feed(period_s, None, own=own)
    try:
        model = load_model(setup.simulator)
        return Feed(period_s, Chain(model), model.sample_time_s, own)
    except RigError:
        return Feed(period_s, None, own=own)
