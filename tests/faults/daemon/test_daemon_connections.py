"""Clients of a daemon of real processes: malformed lines, clients that die, crowds, second daemons, traps."""

import json
import os
import secrets
import signal
import socket
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from rig.errors import RigError
from rig.qualify.faults.bench import START_S, FaultBench
from rig.realtime.shared import KEPT_RING
from rig.realtime.shared import folder as shared_folder
from rig.service.client import Client
from rig.service.connections import protocol
from rig.service.connections.control import MAX_CLIENTS

pytest_plugins = "support.rigs.daemon_rig"


def raw(bench: FaultBench, *lines: bytes) -> list[dict[str, Any]]:
    """What the daemon answers to lines, one answer each."""
    with socket.socket(socket.AF_UNIX) as connection:
        connection.settimeout(10)
        connection.connect(str(bench.socket))
        answers = connection.makefile("rb")
        out = []
        for line in lines:
            connection.sendall(line)
            out.append(json.loads(answers.readline()))
        return out


@pytest.mark.parametrize(
    ("line", "code"),
    [
        (b"nonsense\n", "bad_request"),
        (b'{"v": 1, "id": 3}\n', "unknown_command"),
        (b'{"v": 9, "id": 3, "command": "arm"}\n', "wrong_version"),
        (b'{"v": 1, "id": 3, "command": "arm", "really": true}\n', "bad_argument"),
        (b'{"v": 1, "id": 3, "command": "start", "sweeps": ["relative.yaml"]}\n', "wrong_state"),
        (b'{"v": 1, "id": 3, "command": "subscribe", "rate_hz": 1000}\n', "bad_argument"),
    ],
)
def test_a_malformed_line_gets_one_answer_and_the_connection_lives(
    bench: FaultBench, client: Client, line: bytes, code: str
) -> None:
    bad, good = raw(bench, line, protocol.encode({"id": 4, "command": "status"}))
    assert (bad["ok"], bad["error"]["code"]) == (False, code)
    assert (good["ok"], good["id"]) == (True, 4)


def test_a_line_without_end_is_cut_off(bench: FaultBench, client: Client) -> None:
    (answer,) = raw(bench, b"x" * (protocol.MAX_LINE_BYTES + 10) + b"\n")
    assert answer["error"]["message"] == f"a line has at most {protocol.MAX_LINE_BYTES} bytes"


def test_clients_that_die_in_the_middle_leave_nothing_behind(bench: FaultBench, client: Client) -> None:
    for line in (b'{"v": 1, "id": 3, "comm', protocol.encode({"id": 1, "command": "subscribe", "rate_hz": 50})):
        gone = socket.socket(socket.AF_UNIX)
        gone.connect(str(bench.socket))
        gone.sendall(line)
        gone.close()
    bench.wait(lambda: client.status()["clients"] == 1, "the dead clients to be forgotten")
    assert client.status()["state"] == "disarmed"


def test_too_many_clients_are_turned_away_and_the_others_served(bench: FaultBench, client: Client) -> None:
    bench.wait(lambda: client.status()["clients"] == 1, "the clients of other tests to be forgotten")
    with ExitStack() as crowd:
        for _ in range(MAX_CLIENTS - 1):
            crowd.enter_context(bench.client())
        bench.wait(lambda: client.status()["clients"] == MAX_CLIENTS, "the crowd to be let in")
        with pytest.raises(RigError, match="there are 64 clients already"), bench.client() as late:
            late.status()
        assert client.status()["clients"] == MAX_CLIENTS
    bench.wait(lambda: client.status()["clients"] == 1, "the crowd to go")


def test_silent_connections_from_the_network_and_a_full_house_leave_the_emergency_stop_its_place(
    bench: FaultBench, client: Client, ports: tuple[int, int]
) -> None:
    bench.wait(lambda: client.status()["clients"] == 1, "the clients of other tests to be forgotten")
    with ExitStack() as crowd:
        for _ in range(80):
            crowd.enter_context(socket.create_connection(("127.0.0.1", ports[1]), timeout=10))
        assert client.status()["state"] == "disarmed"
        for _ in range(MAX_CLIENTS - 1 + 20):
            silent = crowd.enter_context(socket.socket(socket.AF_UNIX))
            silent.connect(str(bench.socket))
        with bench.client() as late:
            late.estop()
        bench.wait(lambda: client.status()["fault"], "the fault")
    bench.wait(lambda: client.status()["clients"] == 1, "the crowd to be forgotten")


def second_daemon(bench: FaultBench, place: Path, state: Path) -> str:
    """What one more daemon says, which is refused."""
    command = [sys.executable, "-m", "rig.cli.main", "daemon", "--socket", str(place), "--web", "off"]
    command += ["--logs", str(bench.folder / "other logs"), "--state", str(state)]
    second = subprocess.run(command, capture_output=True, text=True, timeout=START_S, check=False)
    assert second.returncode == 2
    return second.stderr


def test_a_second_daemon_with_the_same_state_folder_or_socket_is_refused(bench: FaultBench, client: Client) -> None:
    other = bench.folder / "t.sock"
    said = f"{bench.state}: another daemon is running with this state folder"
    assert said in second_daemon(bench, other, bench.state)
    link = bench.folder / "link to the state"
    link.symlink_to(bench.state)
    (bench.state / "daemon.lock").unlink()  # as a tidy person would, or a program that cleans /tmp
    assert "another daemon is running with this state folder" in second_daemon(bench, other, link)
    bench.socket.with_name(bench.socket.name + ".lock").unlink()
    assert "another daemon is running, though its lock" in second_daemon(bench, bench.socket, bench.folder / "state 2")
    assert client.status()["state"] == "disarmed"


def test_the_memory_of_a_daemon_that_was_killed_is_saved_by_its_own_next_one_only(
    bench: FaultBench, client: Client, tmp_path: Path
) -> None:
    def black_boxes(of: FaultBench) -> int:
        return len(list((of.state / "blackbox").glob("*.mcap")))

    before = black_boxes(bench)
    os.kill(bench.daemon_pid, signal.SIGKILL)
    bench.end()
    with FaultBench(tmp_path) as other:
        other.start()
        assert black_boxes(other) == 0
        assert f"which the next one with --state {bench.state.resolve()} saves; not touched" in other.log_text()
    bench.start()
    assert black_boxes(bench) == before + 1


def test_a_pipe_among_the_shared_memory_holds_up_no_daemon(bench: FaultBench, client: Client) -> None:
    pipes = [shared_folder() / f"pamrig-{secrets.token_hex(4)}{ending}" for ending in ("", KEPT_RING)]
    for pipe in pipes:
        os.mkfifo(pipe)
    try:
        bench.start()
        assert bench.status()["state"] == "disarmed"
        assert all(pipe.is_fifo() for pipe in pipes)
    finally:
        for pipe in pipes:
            pipe.unlink()


def test_the_socket_is_for_its_owner_only_unless_a_group_is_named(bench: FaultBench, client: Client) -> None:
    assert bench.socket.stat().st_mode & 0o777 == 0o600
