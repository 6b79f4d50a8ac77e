"""The control socket of a process that has no descriptor left."""

import asyncio
import json
import os
import resource
import socket
from pathlib import Path

from support.control_server import handle

from rig.service.connections import protocol
from rig.service.connections.control import Server

LEFT = 4
"""Descriptors for the crowd, which has twice as many clients."""


def test_an_emergency_stop_is_heard_where_a_crowd_has_all_the_descriptors(tmp_path: Path) -> None:
    """It waited to be accepted for as long as the crowd stayed."""
    begun, limit = asyncio.Event(), resource.getrlimit(resource.RLIMIT_NOFILE)

    async def run() -> None:
        server = Server(handle, lambda cursor: {}, begun.set)
        await server.listen(tmp_path / "s", "")
        clients = [
            socket.socket(socket.AF_UNIX) for _ in range(2 * LEFT + 1)
        ]  # before: they are this process's as well
        *crowd, stopping = clients
        next_free = os.dup(0)
        os.close(next_free)
        resource.setrlimit(resource.RLIMIT_NOFILE, (next_free + LEFT, limit[1]))
        try:
            for client in crowd:
                client.connect(str(tmp_path / "s"))
            await asyncio.sleep(0.0)
            stopping.connect(str(tmp_path / "s"))
            stopping.sendall(protocol.encode({"id": 1, "command": "estop"}))
            await asyncio.wait_for(begun.wait(), 10.0)
            stopping.setblocking(False)
            answer = await asyncio.wait_for(asyncio.get_running_loop().sock_recv(stopping, 4096), 10.0)
            assert json.loads(answer)["ok"]
        finally:
            resource.setrlimit(resource.RLIMIT_NOFILE, limit)
            for client in clients:
                client.close()
            await server.close()

    before = len(os.listdir("/proc/self/fd"))
    asyncio.run(run())
    assert len(os.listdir("/proc/self/fd")) == before, "nothing is kept beyond its end"
