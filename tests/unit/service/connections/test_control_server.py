"""The control socket by itself, without a rig behind it: who may reach it, and what listens where."""

import asyncio
import grp
import itertools
import json
import os
import socket
import time
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest
from support.control_server import ask, handle, with_server

from rig.errors import ConfigError, StateError
from rig.service.connections import connection, protocol
from rig.service.connections.control import MAX_CLIENTS, MAX_VIEWERS, Server
from rig.service.connections.protocol import ClientRequest

Streams = tuple[asyncio.StreamReader, asyncio.StreamWriter]
TOKEN = "0123456789abcdef"


def test_answers_come_in_order_and_refusals_are_answers(tmp_path: Path) -> None:
    async def talk(server: Server) -> None:
        await server.listen(tmp_path / "s", "")
        done, refused = await ask(tmp_path / "s", {"id": 1, "command": "reset"}, {"id": "b", "command": "arm"})
        assert done == {"v": 1, "id": 1, "ok": True, "result": {"command": "reset"}}
        assert refused == {"v": 1, "id": "b", "ok": False, "error": {"code": "wrong_state", "message": "not now"}}

    with_server(talk)


@pytest.mark.parametrize("umask", [0o000, 0o077, 0o777])
def test_the_socket_is_its_owner_s_whatever_the_umask_which_stays_as_it_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, umask: int
) -> None:
    """A umask is of all threads: one that made a folder while the socket was made anew could not enter it."""
    before = os.umask(0o022)
    (tmp_path / "run").mkdir()

    async def talk(server: Server) -> None:
        os.umask(umask)
        with monkeypatch.context() as patch:
            patch.setattr(os, "umask", None)
            await server.listen(tmp_path / "run" / "s", "")
        assert (tmp_path / "run" / "s").stat().st_mode & 0o777 == 0o600 & ~umask

    try:
        with_server(talk)
    finally:
        os.umask(before)


@pytest.mark.parametrize("there", [None, 0o777])
def test_the_folder_of_the_socket_is_nobody_else_s_to_write_to(tmp_path: Path, there: int | None) -> None:
    if there is not None:
        (tmp_path / "run").mkdir()
        (tmp_path / "run").chmod(there)

    async def talk(server: Server) -> None:
        before = os.umask(0)
        try:
            await server.listen(tmp_path / "run" / "s", "")
        finally:
            os.umask(before)
        assert (tmp_path / "run").stat().st_mode & 0o777 == 0o755

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


def test_a_stale_socket_is_replaced_and_a_file_of_somebody_s_is_not(tmp_path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as gone:
        gone.bind(str(tmp_path / "s"))
    (tmp_path / "record.mcap").write_text("measured")

    async def talk(server: Server) -> None:
        with pytest.raises(StateError, match=r"record.mcap: is there already and is no socket"):
            await server.listen(tmp_path / "record.mcap", "")
        await server.close()
        await server.listen(tmp_path / "s", "")
        assert (await ask(tmp_path / "s", {"id": 1, "command": "status"}))[0]["ok"]

    with_server(talk)
    assert (tmp_path / "record.mcap").read_text() == "measured"


def test_a_path_may_have_bytes_that_are_no_text(tmp_path: Path) -> None:
    """The daemon ended in a traceback."""
    folder = tmp_path / os.fsdecode(b"caf\xe9")

    async def talk(server: Server) -> None:
        await server.listen(folder / "s", "")
        assert (folder / "s").is_socket()

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


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "::1"])
def test_viewers_are_served_at_any_kind_of_address(host: str) -> None:
    async def talk(server: Server) -> None:
        try:
            port = await server.listen_for_viewers(host, 0, TOKEN)
        except StateError:
            pytest.skip(f"this machine has no {host}")
        reader, writer = await asyncio.open_connection(host, port)
        writer.write(protocol.encode({"id": 1, "command": "status", "token": TOKEN}))
        assert json.loads(await reader.readline())["ok"]
        writer.close()

    with_server(talk)


def test_a_place_that_nobody_has_is_one_line() -> None:
    async def talk(server: Server) -> None:
        with pytest.raises(StateError, match=r"no\.such\.host\.invalid:0: cannot listen there: "):
            await server.listen_for_viewers("no.such.host.invalid", 0, TOKEN)

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


# crowds


async def crowd(opening: Callable[[], Awaitable[Streams]], size: int) -> list[Streams]:
    """So many connections that say nothing."""
    return [await opening() for _ in range(size)]


async def leave(*crowds: list[Streams]) -> None:
    for _, writer in itertools.chain(*crowds):
        writer.close()


def test_a_crowd_over_the_network_takes_no_place_from_the_socket(tmp_path: Path) -> None:
    async def talk(server: Server) -> None:
        await server.listen(tmp_path / "s", "")
        port = await server.listen_for_viewers("127.0.0.1", 0, TOKEN)
        silent = await crowd(lambda: asyncio.open_connection("127.0.0.1", port), 64)
        refused = [await reader.read() for reader, _ in silent[MAX_VIEWERS:]]
        assert all(b"there are 16 clients already" in line for line in refused)
        assert (await ask(tmp_path / "s", {"id": 1, "command": "estop"}))[0]["ok"]
        assert (await ask(tmp_path / "s", {"id": 1, "command": "status"}))[0]["ok"]
        await leave(silent)

    with_server(talk)


def test_when_every_place_is_taken_an_emergency_stop_is_still_heard(tmp_path: Path) -> None:
    async def talk(server: Server) -> None:
        await server.listen(tmp_path / "s", "")
        silent = await crowd(lambda: asyncio.open_unix_connection(tmp_path / "s"), MAX_CLIENTS + 40)
        assert (await ask(tmp_path / "s", {"id": 1, "command": "estop"}))[0] == {
            "v": 1, "id": 1, "ok": True, "result": {"command": "estop"},
        }  # fmt: skip
        for line in ({"id": 1, "command": "status"}, {"id": 1, "command": "arm"}):
            refused = (await ask(tmp_path / "s", line))[0]
            assert refused["error"]["message"] == "there are 64 clients already; only `pamrig estop` is heard now"
        await leave(silent)
        while server.clients:
            await asyncio.sleep(0.01)
        assert (await ask(tmp_path / "s", {"id": 1, "command": "status"}))[0]["ok"]

    with_server(talk)


def test_who_shows_no_token_is_hung_up_on_and_who_shows_it_may_wait_longer(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(connection, "STRANGER_PATIENCE_S", 0.05)

    async def talk(server: Server) -> None:
        port = await server.listen_for_viewers("127.0.0.1", 0, TOKEN)
        silent, writer = await asyncio.open_connection("127.0.0.1", port)
        assert b"no request within 0.05 s" in await silent.read()
        writer.close()
        for line in (b"nonsense\n", protocol.encode({"id": 1, "command": "status", "token": "wrong"})):
            reader, writer = await asyncio.open_connection("127.0.0.1", port)
            writer.write(line)
            assert (await reader.read()).count(b"\n") == 1  # one answer and the end
            writer.close()
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        for pause_s in (0.0, 0.15):
            await asyncio.sleep(pause_s)
            writer.write(protocol.encode({"id": 1, "command": "status", "token": TOKEN}))
            assert json.loads(await reader.readline())["ok"]
        writer.close()

    with_server(talk)


@pytest.mark.parametrize("token", ["\ud800", "\0", "", 7, 10**400, None])
def test_whatever_stands_for_a_token_is_answered(tmp_path: Path, token: object) -> None:
    async def talk(server: Server) -> None:
        port = await server.listen_for_viewers("127.0.0.1", 0, TOKEN)
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        writer.write(protocol.encode({"id": 1, "command": "status", "token": token}))
        assert json.loads(await reader.readline())["error"]["message"] == "the token is missing or wrong"
        writer.close()

    with_server(talk)


def test_a_bug_is_an_answer_and_the_next_request_is_heard(tmp_path: Path) -> None:
    async def buggy(request: ClientRequest) -> Any:
        if request.command == "arm":
            raise ZeroDivisionError("a bug")
        return "done"

    async def talk(_: Server) -> None:
        server = Server(buggy, lambda _: {})
        await server.listen(tmp_path / "s", "")
        bug, done = await ask(tmp_path / "s", {"id": 1, "command": "arm"}, {"id": 2, "command": "estop"})
        assert "please report it: ZeroDivisionError('a bug')" in bug["error"]["message"]
        assert done["result"] == "done"
        await server.close()

    with_server(talk)


async def answered_before_accepted(path: Path, line: bytes) -> bytes:
    """The answer to a line that is there before the server has looked at its client."""
    client = socket.socket(socket.AF_UNIX)
    client.connect(str(path))
    client.sendall(line)
    reader, writer = await asyncio.open_unix_connection(sock=client)
    answer = await reader.readline()
    writer.close()
    return answer


def test_an_emergency_stop_begins_before_its_client_has_a_place(tmp_path: Path) -> None:
    stopped: list[str] = []

    async def talk(_: Server) -> None:
        server = Server(handle, lambda _: {}, lambda: stopped.append("at once"))
        await server.listen(tmp_path / "s", "")
        for line in (
            b'{"v": 1, "command": "status", "id": "\\"estop\\""}\n',
            b'{"v": 2, "command": "estop"}\n',
            b'"estop"\n',
        ):
            await answered_before_accepted(tmp_path / "s", line)
        assert stopped == []
        assert json.loads(
            await answered_before_accepted(tmp_path / "s", protocol.encode({"id": 1, "command": "estop"}))
        )["ok"]
        assert stopped == ["at once"]
        await server.close()

    with_server(talk)


def test_between_two_who_look_an_emergency_stop_is_served(tmp_path: Path) -> None:
    """63 clients that ask for nothing but the status wait for each other, not the emergency stop for all of them."""
    order: list[str] = []

    async def slow(request: ClientRequest) -> Any:
        order.append(request.command)
        if request.command == "status":
            time.sleep(0.001)  # what making one takes

    async def talk(_: Server) -> None:
        server = Server(slow, lambda _: {})
        await server.listen(tmp_path / "s", "")
        flood = await crowd(lambda: asyncio.open_unix_connection(tmp_path / "s"), 63)
        _, stop = await asyncio.open_unix_connection(tmp_path / "s")
        await asyncio.sleep(0.05)
        for _, writer in flood:
            writer.write(protocol.encode({"id": 1, "command": "status"}))
        stop.write(protocol.encode({"id": 1, "command": "estop"}))
        while "estop" not in order:
            await asyncio.sleep(0)
        assert order.count("status") <= 5
        await leave(flood)
        stop.close()
        await server.close()

    with_server(talk)


def test_behind_a_start_that_is_being_looked_at_an_emergency_stop_is_heard_at_once(tmp_path: Path) -> None:
    """On the same connection; what else is said there waits for its turn."""
    stopped = asyncio.Event()

    async def slow(request: ClientRequest) -> Any:
        if request.command == "start":
            await stopped.wait()
        if request.command == "estop":
            stopped.set()
        return request.command

    async def talk(_: Server) -> None:
        server = Server(slow, lambda _: {})
        await server.listen(tmp_path / "s", "")
        reader, writer = await asyncio.open_unix_connection(tmp_path / "s")
        for number, command in enumerate(("start", "estop", "clear")):
            writer.write(protocol.encode({"id": number, "command": command}))
            await asyncio.sleep(0.01)
        answers = [json.loads(await asyncio.wait_for(reader.readline(), 10.0)) for _ in range(3)]
        assert [(answer["id"], answer["result"]) for answer in answers] == [(1, "estop"), (0, "start"), (2, "clear")]
        writer.close()
        await server.close()

    with_server(talk)
