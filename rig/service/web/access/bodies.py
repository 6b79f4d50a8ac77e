"""What requests carry: a few short fields, as JSON or as a form. Nothing is ever uploaded."""

import asyncio
import json
import math
from typing import Any, Final
from urllib.parse import parse_qsl

from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request

from rig.service.web.access.guard import visitor_of
from rig.service.web.access.visitors import Visitors

MOST_BODY_BYTES: Final = 16 * 1024
"""Bytes of a request's body at most."""
BODY_PATIENCE_S: Final = 5.0
"""For a whole request, s."""
_MOST_FIELDS: Final = 20


async def fields(request: Request, visitors: Visitors) -> dict[str, Any]:
    """The fields of a request that may change something. HTTPException for one that is too long, too slow, of another
    kind, or from a browser that does not say where it comes from and has no key of our forms."""
    given = _parse(request.headers.get("content-type", ""), await _read(request))
    key = str(given.pop("form_key", ""))
    if request.scope.get("needs_form_key") and not visitors.is_form_key(visitor_of(request.scope), key):
        raise HTTPException(403, "the form is not of this page, or of another day; load the page again")
    return given


def number(given: dict[str, Any], name: str, default: float) -> float:
    """A field as a number, written with a point or with a comma; HTTPException when it is none."""
    text = str(given.get(name, default)).strip().replace(",", ".") or str(default)
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise HTTPException(400, f"{name}: {text[:40]!a} is no number")
    return value


def text(given: dict[str, Any], name: str) -> str:
    """A field as text, empty when it is missing; HTTPException for another kind of value."""
    value = given.get(name, "")
    if not isinstance(value, str):
        raise HTTPException(400, f"{name}: expected text")
    return value


def texts(given: dict[str, Any], name: str) -> list[str]:
    """A field as a list of texts; HTTPException for anything else."""
    value = given.get(name, [])
    if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
        raise HTTPException(400, f"{name}: expected a list of texts")
    return value


async def _read(request: Request) -> bytes:
    body = b""
    try:
        async with asyncio.timeout(BODY_PATIENCE_S):
            async for part in request.stream():
                body += part
                if len(body) > MOST_BODY_BYTES:
                    raise HTTPException(413, f"a request has at most {MOST_BODY_BYTES} bytes", {"Connection": "close"})
    except ClientDisconnect:
        raise HTTPException(400, "the request was cut short") from None
    except TimeoutError:
        raise HTTPException(
            408, f"the request did not come within {BODY_PATIENCE_S:g} s", {"Connection": "close"}
        ) from None
    return body


def _parse(kind: str, body: bytes) -> dict[str, Any]:
    kind = kind.partition(";")[0].strip().lower()
    if not body and kind in ("", "application/json", "application/x-www-form-urlencoded"):
        return {}
    try:
        if kind == "application/json":
            given = json.loads(body)
            json.dumps(given, ensure_ascii=False).encode()  # halves of characters are no text
        elif kind == "application/x-www-form-urlencoded":
            given = dict(parse_qsl(body.decode(), keep_blank_values=True, max_num_fields=_MOST_FIELDS))
        else:
            raise HTTPException(415, "expected JSON or a form without files")
    except (ValueError, RecursionError):
        raise HTTPException(400, "the request cannot be read") from None
    if not isinstance(given, dict):
        raise HTTPException(400, "expected a mapping")
    return given
