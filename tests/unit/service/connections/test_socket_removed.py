"""A daemon's socket that somebody removes, or puts something else in its place, while the daemon runs."""

import asyncio
import json
import os
import resource
import socket
from pathlib import Path

import pytest
from support.control_server import ask, with_server

from rig.errors import StateError
from rig.service.connections import protocol
from rig.service.connections.control import Server


def test_a_socket_that_somebody_removed_is_made_again(tmp_path: Path) -> None:
    """Its daemon ran on, and nobody could stop the rig by it."""
    path = tmp_path / "folder" / "s"

    async def talk(server: Server) -> None:
        await server.listen(path, "")
        reader, writer = await asyncio.open_unix_connection(path)
        assert not server.stay_reachable()
        path.unlink()
        path.with_name("s.lock").unlink()
        path.parent.rmdir()
        assert server.stay_reachable()
        assert [answer["ok"] for answer in await ask(path, {"id": 1, "command": "reset"})] == [True]
        writer.write(protocol.encode({"id": 2, "command": "reset"}))
        assert json.loads(await reader.readline())["ok"], "who was connected still is"
        writer.close()
        assert not server.stay_reachable()

    with_server(talk)
    assert not path.exists()


def descriptors() -> int:
    return len(os.listdir("/proc/self/fd"))


def test_a_socket_that_is_removed_again_and_again_leaves_nothing_behind(tmp_path: Path) -> None:
    """Its old listener stayed, a descriptor each, until no client could be let in any more."""
    path = tmp_path / "s"

    async def talk(server: Server) -> None:
        await server.listen(path, "")
        before, first = descriptors(), await asyncio.open_unix_connection(path)
        for _ in range(20):
            path.unlink()
            assert server.stay_reachable()
        assert (await ask(path, {"id": 1, "command": "reset"}))[0]["ok"]
        first[1].write(protocol.encode({"id": 2, "command": "reset"}))
        assert json.loads(await first[0].readline())["ok"], "who was connected first still is"
        first[1].close()
        for _ in range(1000):
            await asyncio.sleep(0)
            assert not server.stay_reachable()
        assert descriptors() <= before

    with_server(talk)


def test_a_socket_that_cannot_be_made_at_present_is_tried_again(tmp_path: Path) -> None:
    """Without a descriptor for it the daemon ended, and its rig with it."""
    path = tmp_path / "s"

    async def talk(server: Server) -> None:
        await server.listen(path, "")
        path.unlink()
        most = resource.getrlimit(resource.RLIMIT_NOFILE)
        resource.setrlimit(resource.RLIMIT_NOFILE, (0, most[1]))
        try:
            with pytest.raises(StateError, match="s: cannot be made: Too many open files"):
                server.stay_reachable()
        finally:
            resource.setrlimit(resource.RLIMIT_NOFILE, most)
        assert server.stay_reachable()
        assert (await ask(path, {"id": 1, "command": "reset"}))[0]["ok"]

    with_server(talk)


def test_who_has_called_at_a_socket_that_is_removed_is_still_heard(tmp_path: Path) -> None:
    """More than are let in at once, and none of them taken from the socket yet."""
    path = tmp_path / "s"

    async def talk(server: Server) -> None:
        await server.listen(path, "")
        callers = [socket.socket(socket.AF_UNIX) for _ in range(40)]
        for caller in callers:
            caller.connect(str(path))
            caller.sendall(protocol.encode({"id": 1, "command": "reset"}))
        path.unlink()
        assert server.stay_reachable()
        for caller in callers:
            with caller:
                reader, writer = await asyncio.open_unix_connection(sock=caller)
                assert json.loads(await reader.readline())["ok"]
                writer.close()

    with_server(talk)


@pytest.mark.parametrize("other", ["a file", "a dead socket"])
def test_something_else_at_the_socket_s_place_is_no_socket_of_ours(tmp_path: Path, other: str) -> None:
    """It was taken for the daemon's own, and removed at its end."""
    path = tmp_path / "s"

    async def talk(server: Server) -> None:
        await server.listen(path, "")
        path.unlink()
        if other == "a file":
            path.write_text("somebody's")
            with pytest.raises(StateError, match="is there already and is no socket"):
                server.stay_reachable()
        else:
            with socket.socket(socket.AF_UNIX) as dead:
                dead.bind(str(path))
            assert server.stay_reachable()
            assert (await ask(path, {"id": 1, "command": "reset"}))[0]["ok"]

    with_server(talk)
    assert path.exists() is (other == "a file")
