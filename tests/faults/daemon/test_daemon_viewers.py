"""Who looks at a daemon of real processes: subscribers, the network, the live view, the terminal, Prometheus."""

import asyncio
import fcntl
import json
import os
import pty
import select
import signal
import socket
import struct
import subprocess
import sys
import termios
from contextlib import suppress
from typing import Any

import psutil
import pytest

from rig.log.mcap.schema import SAMPLE_SCHEMA, SAMPLE_TOPIC
from rig.qualify.faults.bench import FaultBench
from rig.service.client import Client
from rig.service.connections import protocol

pytest_plugins = "support.rigs.daemon_rig"


def test_a_subscriber_gets_status_and_every_sample_once(bench: FaultBench, client: Client) -> None:
    with bench.client() as other:
        ticks: list[int] = []
        for status, _ in zip(other.subscribe(20.0, samples=True), range(12), strict=False):
            ticks += status["samples"]["tick"]
    assert len(ticks) > 50
    assert ticks == sorted(set(ticks))


def test_over_the_network_one_may_look_with_the_token_and_nothing_else(
    bench: FaultBench, client: Client, ports: tuple[int, int]
) -> None:
    def ask(**fields: object) -> dict[str, Any]:
        with socket.create_connection(("127.0.0.1", ports[1]), timeout=10) as connection:
            connection.sendall(protocol.encode({"id": 1} | fields))
            return dict(json.loads(connection.makefile("rb").readline()))

    token = (bench.folder / "token").read_text()
    assert ask(command="status", token=token)["result"]["state"] == "disarmed"
    assert ask(command="status")["error"] == {"code": "not_allowed", "message": "the token is missing or wrong"}
    assert ask(command="status", token=token[:-1] + "0")["error"]["code"] == "not_allowed"
    for command in ("arm", "estop", "reset", "start", "stop", "clear"):
        assert "not allowed over the network" in ask(command=command, token=token)["error"]["message"]
    assert client.status()["state"] == "disarmed"


def test_the_live_view_speaks_foxglove_s_protocol_and_sends_samples_whoever_was_lost(
    bench: FaultBench, client: Client, ports: tuple[int, int]
) -> None:
    websockets = pytest.importorskip("websockets")
    pytest.importorskip("foxglove")

    async def look() -> tuple[dict[str, Any], bytes]:
        uri = f"ws://127.0.0.1:{ports[0]}"
        async with websockets.connect(uri, subprotocols=["foxglove.sdk.v1", "foxglove.websocket.v1"]) as server:
            channels: list[dict[str, Any]] = []
            while not any(channel["topic"] == SAMPLE_TOPIC for channel in channels):
                message = await asyncio.wait_for(server.recv(), 10)
                if isinstance(message, str) and (said := json.loads(message)).get("op") == "advertise":
                    channels += said["channels"]
            (channel,) = [one for one in channels if one["topic"] == SAMPLE_TOPIC]
            await server.send(json.dumps({"op": "subscribe", "subscriptions": [{"id": 5, "channelId": channel["id"]}]}))
            while True:
                message = await asyncio.wait_for(server.recv(), 10)
                if isinstance(message, bytes):
                    return channel, message

    def listens() -> bool:
        with socket.socket() as probe:
            return probe.connect_ex(("127.0.0.1", ports[0])) == 0

    bench.wait(listens, "the live view's process, which comes up beside the daemon")
    for blow in (signal.SIGSTOP, signal.SIGKILL):
        struck = bench.wait(lambda: listener(bench, ports[0]), "the live view")
        os.kill(struck, blow)
        bench.wait(
            lambda struck=struck: listener(bench, ports[0]) not in (0, struck), "another process of the live view"
        )
    channel, message = asyncio.run(look())
    assert (channel["encoding"], channel["schemaName"]) == ("protobuf", SAMPLE_SCHEMA)
    from rig.sample import SAMPLE_BYTES, unpack

    assert message[0] == 1  # message data: opcode, subscription id, log time, payload
    assert int.from_bytes(message[1:5], "little") == 5
    assert len(message) == 13 + SAMPLE_BYTES
    assert unpack(message[13:]).p1_cmd_mpa == pytest.approx(0.15)


def listener(bench: FaultBench, port: int) -> int:
    """Pid of the daemon's process that listens there, 0 when none does."""
    for child in psutil.Process(bench.daemon_pid).children(recursive=True):
        with suppress(psutil.Error):
            if any(
                place.status == psutil.CONN_LISTEN and place.laddr.port == port for place in child.net_connections()
            ):
                return int(child.pid)
    return 0


def test_watch_draws_in_a_real_terminal_and_obeys_its_keys(bench: FaultBench, client: Client) -> None:
    terminal, inside = pty.openpty()
    fcntl.ioctl(inside, termios.TIOCSWINSZ, struct.pack("HHHH", 50, 140, 0, 0))
    command = [sys.executable, "-m", "rig.cli.main", "watch", "--socket", str(bench.socket)]
    environment = {**os.environ, "TERM": "xterm-256color"}
    seen = bytearray()

    def shows(what: bytes) -> bool:
        while select.select([terminal], [], [], 0)[0]:
            seen.extend(os.read(terminal, 65536))
        return what in seen

    with subprocess.Popen(command, stdin=inside, stdout=inside, stderr=inside, env=environment) as watch:
        bench.wait(lambda: shows(b"angle in degrees over seconds"), "the picture")
        os.write(terminal, b"e")
        bench.wait(lambda: shows(b"ESTOP"), "the emergency stop in the picture")
        os.write(terminal, b"q")
        bench.wait(lambda: shows(b"never there") or watch.poll() is not None, "the end of watch")
    assert watch.returncode == 0
    assert client.status()["fault"]["name"] == "ESTOP"
    os.close(terminal)
    os.close(inside)


def test_the_metrics_are_what_prometheus_reads(bench: FaultBench, client: Client) -> None:
    parser = pytest.importorskip("prometheus_client.parser")
    text = bench.wait(
        lambda: (bench.folder / "pamrig.prom").read_text() if (bench.folder / "pamrig.prom").exists() else "", "metrics"
    )
    names = {family.name for family in parser.text_string_to_metric_families(text)}
    assert {
        "pamrig_state",
        "pamrig_fault_code",
        "pamrig_loop_missed",
        "pamrig_process_alive",
        "pamrig_disk_free_bytes",
    } <= names
