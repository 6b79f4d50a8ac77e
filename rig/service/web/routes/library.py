"""What can be looked up: sweeps with a preview, past records with their plots, checks and comparisons."""

from collections.abc import Awaitable, Callable
from typing import Any, Final

from starlette.requests import Request
from starlette.responses import FileResponse, Response
from starlette.routing import Route

from rig.errors import RecordError, RigError
from rig.rig_config import RigConfig
from rig.service.web.files import curves
from rig.service.web.files.catalogue import Catalogue
from rig.service.web.files.records import SessionFolders, spelt
from rig.service.web.routes.answer import EscapedJson
from rig.service.web.worker import PageWorker

_MISSING: Final = 404
_UNFIT: Final = 422
Look = Callable[[Request], Awaitable[Any]]


class LibraryRoutes:
    """All of it is GET, and changes nothing."""

    def __init__(self, rig: RigConfig, sweeps: Catalogue, records: SessionFolders, worker: PageWorker) -> None:
        self._rig, self._sweeps, self._records, self._worker = rig, sweeps, records, worker

    def routes(self) -> list[Route]:
        """Where each is found."""
        looks: dict[str, Look] = {
            "/api/sweeps": self._all_sweeps,
            "/api/sweeps/{name}": self._preview,
            "/api/sessions": self._sessions,
            "/api/sessions/{session}": self._session,
            "/api/records/{session}/{name}": self._record,
            "/api/records/{session}/{name}/check": self._check,
            "/api/compare": self._compare,
        }
        return [
            *(Route(path, answered(look)) for path, look in looks.items()),
            Route("/api/records/{session}/{name}/file", self._file),
        ]

    async def _all_sweeps(self, _: Request) -> Any:
        return {"sweeps": self._sweeps.names}

    async def _preview(self, request: Request) -> Any:
        return await self._worker.run(curves.preview, self._sweeps.path(request.path_params["name"]), self._rig)

    async def _sessions(self, _: Request) -> Any:
        return {"sessions": self._records.sessions()}

    async def _session(self, request: Request) -> Any:
        files = self._records.files(request.path_params["session"])
        entries = [{"name": spelt(file.name), "bytes": file.stat().st_size} for file in files]
        facts = await self._worker.run(facts_of_all, files)
        return {"records": [each | fact for each, fact in zip(entries, facts, strict=True)]}

    async def _record(self, request: Request) -> Any:
        path = self._chosen(request)
        try:
            return await self._worker.run(curves.record, path)
        except RigError as error:  # an answer too: the file is there, and this is what it is
            return {"problem": str(error).removeprefix(f"{path}: ")}

    async def _check(self, request: Request) -> Any:
        found = await self._worker.run(curves.findings, self._chosen(request))
        return {"ok": not found, "findings": found}

    async def _compare(self, request: Request) -> Any:
        chosen = [request.query_params.get(side, "").partition("/") for side in ("a", "b")]
        a, b = (self._records.file(session, name) for session, _, name in chosen)
        return await self._worker.run(curves.compared, a, b)

    async def _file(self, request: Request) -> Response:
        """The record itself."""
        try:
            path = self._chosen(request)
        except RecordError as error:
            return EscapedJson({"error": str(error)}, _MISSING)
        return FileResponse(path, media_type="application/octet-stream", filename=spelt(path.name))

    def _chosen(self, request: Request) -> Any:
        return self._records.file(request.path_params["session"], request.path_params["name"])


def answered(look: Look) -> Callable[[Request], Awaitable[Response]]:
    """A handler: what is found as JSON, what is not as one line; also a file that goes away while it is looked at."""

    async def handle(request: Request) -> Response:
        try:
            return EscapedJson(await look(request))
        except RigError as error:
            return EscapedJson({"error": str(error)}, _MISSING if "no such" in str(error) else _UNFIT)
        except OSError as error:
            gone = f"{spelt(str(error.filename or 'a file'))}: {error.strerror or error}"
            return EscapedJson({"error": gone}, _MISSING)

    return handle


def facts_of_all(files: list[Any]) -> list[dict[str, Any]]:
    """Of every record of a session; called in the worker's process."""
    return [curves.facts_of(file) for file in files]
