"""The control socket by itself, without a rig behind it, and a client that asks it."""

import asyncio
import json
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

from rig.service.connections import protocol
from rig.service.connections.control import Server
from rig.service.connections.protocol import ClientRequest, Code, Refused

Talk = Callable[[Server], Awaitable[None]]


async def handle(request: ClientRequest) -> Any:
    if request.command == "arm":
        raise Refused(Code.WRONG_STATE, "not now")
    return {"command": request.command}


def with_server(talk: Talk) -> None:
    async def run() -> None:
        server = Server(handle, lambda cursor: {"state": "armed", "cursor": cursor})
        try:
            await talk(server)
        finally:
            await server.close()

    asyncio.run(run())


async def ask(path: Path, *messages: dict[str, Any]) -> list[dict[str, Any]]:
    reader, writer = await asyncio.open_unix_connection(path)
    answers = []
    for message in messages:
        writer.write(protocol.encode(message))
        answers.append(json.loads(await reader.readline()))
    writer.close()
    return answers
