"""Who may connect, and which connection gives way."""

import asyncio
import os
import socket
from dataclasses import dataclass
from pathlib import Path

import pytest

from rig.service.web.access.gate import ANSWER_S, REQUEST_S, OpenConnections
from rig.service.web.access.peers import listed, may_come, owner_of


@dataclass(eq=False)
class OneConnection:
    busy: bool = False
    gone: bool = False

    def hang_up(self) -> None:
        self.gone = True


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


def held(most: int) -> tuple[OpenConnections, Clock]:
    clock = Clock()
    return OpenConnections(clock, most), clock


@pytest.mark.parametrize(("family", "host"), [(socket.AF_INET, "127.0.0.1"), (socket.AF_INET6, "::1")])
def test_the_kernel_knows_who_connects(family: socket.AddressFamily, host: str) -> None:
    try:
        listening = socket.create_server((host, 0), family=family)
    except OSError:
        pytest.skip(f"no {host} on this machine")
    with listening, socket.create_connection(listening.getsockname()[:2]) as client:
        served, peer = listening.accept()
        with served:
            for asked in (owner_of, listed):
                assert asked(peer, served.getsockname()) == os.getuid()
                assert asked((host, 1), served.getsockname()) is None
            assert client.fileno() >= 0


def test_another_users_connection_is_told_by_the_table(tmp_path: Path) -> None:
    table = tmp_path / "tcp"
    table.write_text(
        "  sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid  timeout inode\n"
        "   1: 0100007F:D431 0100007F:20E4 01 00000000:00000000 00:00000000 00000000  1234        0 66\n"
    )
    assert listed(("127.0.0.1", 0xD431), ("127.0.0.1", 0x20E4), table) == 1234
    assert listed(("127.0.0.1", 0xD431), ("127.0.0.1", 0x20E5), table) is None


def test_only_the_daemons_user_root_and_the_group_may_come() -> None:
    assert may_come(os.getuid(), "")
    assert may_come(0, "")
    assert not may_come(None, "")
    assert not may_come(4_000_000, "")
    assert not may_come(4_000_000, "no such group")


def test_the_longest_idle_gives_way_and_who_is_answered_does_not() -> None:
    async def scene() -> None:
        held_open, _ = held(3)
        busy, first, second, third = OneConnection(busy=True), OneConnection(), OneConnection(), OneConnection()
        assert all(held_open.enter(one) for one in (busy, first, second))
        held_open.stir(first)
        assert held_open.enter(third)
        assert [one.gone for one in (busy, first, second, third)] == [False, False, True, False]
        first.busy = third.busy = True
        assert not held_open.enter(OneConnection())

    asyncio.run(scene())


def test_who_says_nothing_or_takes_nothing_is_overdue() -> None:
    async def scene() -> None:
        held_open, clock = held(9)
        silent, deaf = OneConnection(), OneConnection(busy=True)
        held_open.enter(silent)
        held_open.enter(deaf)
        clock.now = REQUEST_S
        assert held_open.overdue() == []
        clock.now = REQUEST_S + 0.1
        assert held_open.overdue() == [silent]
        held_open.leave(silent)
        clock.now = ANSWER_S + 0.1
        assert held_open.overdue() == [deaf]

    asyncio.run(scene())
