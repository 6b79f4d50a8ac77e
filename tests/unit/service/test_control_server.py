"""The control socket by itself, without a rig behind it: who may reach it, and what listens where."""

import asyncio
import grp
import json
import os
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest

from rig.errors import ConfigError, StateError
from rig.service import protocol
from rig.service.control import Server
from rig.service.protocol import Code, Refused, Request

Talk = Callable[[Server], Awaitable[None]]


async def handle(request: Request) -> Any:
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


def test_answers_come_in_order_and_refusals_are_answers(tmp_path: Path) -> None:
    async def talk(server: Server) -> None:
        await server.listen(tmp_path / "s", "")
        done, refused = await ask(tmp_path / "s", {"id": 1, "command": "reset"}, {"id": "b", "command": "arm"})
        assert done == {"v": 1, "id": 1, "ok": True, "result": {"command": "reset"}}
        assert refused == {"v": 1, "id": "b", "ok": False, "error": {"code": "wrong_state", "message": "not now"}}

    with_server(talk)


def test_the_group_of_the_settings_may_command_and_nobody_else(tmp_path: Path) -> None:
    async def talk(server: Server) -> None:
        await server.listen(tmp_path / "s", grp.getgrgid(os.getgid()).gr_name)
        assert (tmp_path / "s").stat().st_mode & 0o777 == 0o660

    with_server(talk)


def test_a_group_that_does_not_exist_is_a_config_error(tmp_path: Path) -> None:
    async def talk(server: Server) -> None:
        with pytest.raises(ConfigError, match="group: 'no such group' does not exist; make it with `groupadd"):
            await server.listen(tmp_path / "s", "no such group")

    with_server(talk)


def test_a_second_server_is_refused_and_the_socket_goes_with_the_first(tmp_path: Path) -> None:
    async def talk(server: Server) -> None:
        await server.listen(tmp_path / "s", "")
        second = Server(handle, lambda _: {})
        with pytest.raises(StateError, match="another daemon is running"):
            await second.listen(tmp_path / "s", "")
        await second.close()
        assert (tmp_path / "s").is_socket()

    with_server(talk)
    assert not (tmp_path / "s").exists()


def test_a_stale_socket_is_replaced(tmp_path: Path) -> None:
    (tmp_path / "s").write_text("left behind")

    async def talk(server: Server) -> None:
        await server.listen(tmp_path / "s", "")
        assert (await ask(tmp_path / "s", {"id": 1, "command": "status"}))[0]["ok"]

    with_server(talk)


def test_a_path_that_is_too_long_for_a_socket_is_said_to_be(tmp_path: Path) -> None:
    async def talk(server: Server) -> None:
        with pytest.raises(ConfigError, match="a socket's path has at most 107 bytes"):
            await server.listen(tmp_path / ("x" * 120), "")

    with_server(talk)


def test_viewers_without_a_token_set_see_nothing(tmp_path: Path) -> None:
    async def talk(server: Server) -> None:
        port = await server.listen_for_viewers("127.0.0.1", 0, "")
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        writer.write(protocol.encode({"id": 1, "command": "status", "token": ""}))
        assert json.loads(await reader.readline())["error"]["code"] == "not_allowed"
        writer.close()

    with_server(talk)


def test_a_subscriber_that_does_not_read_is_not_waited_for(tmp_path: Path) -> None:
    async def talk(server: Server) -> None:
        heavy = Server(handle, lambda cursor: {"filling": "x" * 100_000})
        await heavy.listen(tmp_path / "s", "")
        _, lazy = await asyncio.open_unix_connection(tmp_path / "s", limit=1024)
        lazy.write(protocol.encode({"id": 1, "command": "subscribe", "rate_hz": 50}))
        while heavy.dropped_events < 3:
            await asyncio.sleep(0.02)
        assert (await ask(tmp_path / "s", {"id": 1, "command": "status"}))[0]["ok"]
        lazy.close()
        await heavy.close()

    with_server(talk)
