"""The routes of diagnosis and bring-up."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from starlette.requests import Request
from starlette.responses import HTMLResponse, Response
from starlette.routing import Route

from rig.errors import RecordError, StateError
from rig.service.web.access.bodies import text, texts
from rig.service.web.access.guard import visitor_of
from rig.service.web.files.bringup import BringUp
from rig.service.web.files.catalogue import Catalogue
from rig.service.web.files.diagnoses import REFERENCE_CHOICES, Diagnoses, DiagnosisRequest
from rig.service.web.files.history import history_json
from rig.service.web.files.hunts import hunts
from rig.service.web.files.records import SessionFolders
from rig.service.web.routes.actions import Actions
from rig.service.web.routes.answer import EscapedJson
from rig.service.web.routes.library import answered
from rig.service.web.worker import PageWorker

REPORT_POLICY: Final = (
    "default-src 'none'; style-src 'unsafe-inline'; img-src data:; frame-ancestors 'self'; sandbox allow-same-origin"
)
"""A report brings its own styles and figures, and may run nothing: it is shown without scripts and forms. The page
around it may look into it, so that the Escape key stops there too."""


class Studies:
    """Diagnoses and bring-up: what reads and computes, and moves nothing."""

    def __init__(
        self,
        diagnoses: Diagnoses,
        bringup: BringUp,
        records: SessionFolders,
        models: Catalogue,
        worker: PageWorker,
        shown: Callable[[], dict[str, Any]],
    ) -> None:
        self._diagnoses, self._bringup, self._records, self._models = diagnoses, bringup, records, models
        self._worker, self._shown = worker, shown

    def routes(self, actions: Actions) -> list[Route]:
        """Looking is for everybody, asking for who commands: the machine has better things to do."""
        return [
            Route("/api/diagnoses", answered(self._all)),
            Route("/api/diagnoses/begin", actions.command(self._begin), methods=["POST"]),
            Route("/diagnoses/{name}", self._report),
            Route("/api/history", answered(self._history)),
            Route("/api/hunts", answered(self._hunts)),
            Route("/api/bring-up", answered(self._steps)),
            Route("/api/bring-up/confirm", actions.command(self._confirm), methods=["POST"]),
        ]

    async def _all(self, _: Request) -> Any:
        return {"diagnoses": self._diagnoses.all(), "models": self._models.names, "references": REFERENCE_CHOICES}

    async def _history(self, request: Request) -> Any:
        asked = request.query_params
        days = self._diagnoses.days(asked.get("model", ""), asked.get("reference", ""))
        return await self._worker.run(history_json, days)

    async def _hunts(self, _: Request) -> Any:
        return {"hunts": hunts(self._records.root)}

    async def _begin(self, _: Request, given: dict[str, Any]) -> Any:
        if self._shown().get("state") == "running":
            raise StateError("the rig is running; diagnose when it rests")
        question = DiagnosisRequest(
            text(given, "session"), text(given, "model"), text(given, "reference"), tuple(texts(given, "baselines")),
            time.time(), self._records.recorded_s(text(given, "session")),
        )  # fmt: skip
        log, model = self._folder(question.session), self._models.path(question.model)
        return self._diagnoses.begin(question, log, model, [self._folder(name) for name in question.baselines])

    def _folder(self, session: str) -> Path:
        return self._records.folder(session)

    async def _report(self, request: Request) -> Response:
        try:
            path = self._diagnoses.report(request.path_params["name"])
        except RecordError as error:
            return EscapedJson({"error": str(error)}, 404)
        headers = {"Content-Security-Policy": REPORT_POLICY, "X-Frame-Options": "SAMEORIGIN"}
        return HTMLResponse(path.read_text(encoding="utf-8"), headers=headers)

    async def _steps(self, _: Request) -> Any:
        return self._bringup.to_json(self._shown())

    async def _confirm(self, request: Request, given: dict[str, Any]) -> Any:
        by = f"browser {visitor_of(request.scope).name}"
        self._bringup.confirm(text(given, "step"), by, done=given.get("done") is True)
        return self._bringup.to_json(self._shown())
