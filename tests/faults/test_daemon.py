"""A daemon of real processes: what operators do and do wrong, clients that misbehave, viewers, the live view, and
restarts."""

import asyncio
import fcntl
import json
import os
import pty
import secrets
import select
import socket
import struct
import subprocess
import sys
import termios
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from rig.cli import daemon as cli_daemon
from rig.errors import RigError, StateError
from rig.log.mcap.schema import SAMPLE_SCHEMA, SAMPLE_TOPIC
from rig.qualify.faults.bench import SAFE_MPA, FaultBench
from rig.realtime.shared import KEPT_RING
from rig.realtime.shared import folder as shared_folder
from rig.service import protocol
from rig.service.client import Client
from rig.service.control import MAX_CLIENTS
from rig.service.ledger import Ledger

pytestmark = pytest.mark.xdist_group("real processes")
TOKEN = "0123456789abcdef"
SHORT = """\
settle_s: 0.1
zero_s: 0.05
ramp_in_s: 0.1
duration_s: 0.5
ramp_out_s: 0.1
records: [{hold: {amplitude_mpa: [0.05, 0.1]}}]
"""


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@pytest.fixture(scope="module")
def ports() -> tuple[int, int]:
    return free_port(), free_port()


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory, ports: tuple[int, int]) -> Iterator[FaultBench]:
    folder = Path(tmp_path_factory.mktemp("daemon"))
    (folder / "token").write_text(TOKEN)
    metrics = folder / "pamrig.prom"
    (folder / "daemon.yaml").write_text(
        f"live: {{port: {ports[0]}}}\nview: {{port: {ports[1]}, token_file: {folder / 'token'}}}\nmetrics: {metrics}\n"
    )
    (folder / "short.yaml").write_text(SHORT)
    with FaultBench(folder, arguments=("--config", str(folder / "daemon.yaml"))) as bench:
        bench.start()
        yield bench


@pytest.fixture
def client(bench: FaultBench) -> Iterator[Client]:
    """Connected to a disarmed daemon with an empty queue."""
    with bench.client() as client:
        if client.status()["state"] == "fault":
            client.reset()
        if client.status()["state"] == "running":
            client.stop()
            client.wait()
        if client.status()["state"] != "disarmed":
            client.stop()
        client.clear()
        yield client


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


def pressures(client: Client) -> tuple[float, float]:
    """Measured now, MPa."""
    sample = client.status()["loop"]
    return sample["p1_mpa"], sample["p2_mpa"]


# an operator's day


def test_arm_start_two_sweeps_with_a_pause_and_disarm(bench: FaultBench, client: Client) -> None:
    client.arm()
    assert client.status()["state"] == "armed"
    jobs = client.start(bench.folder / "short.yaml", bench.folder / "short.yaml", pause_s=0.2)
    assert [job["records"] for job in jobs] == [2, 2]
    seen = []
    while (status := client.status())["working"]:
        seen.append(status["left_s"])
        time.sleep(0.02)
    assert seen[0] > 2.0
    assert seen[-1] < 1.0
    done = [job for job in status["queue"] if job["id"] in [job["id"] for job in jobs]]
    assert [(job["state"], job["done"]) for job in done] == [("done", 2), ("done", 2)]
    files = [Path(file) for job in done for file in job["files"]]
    assert len(set(files)) == 4
    assert all(file.stat().st_size > 1000 for file in files)
    assert {str(file) for file in files} <= {entry.path for entry in Ledger(bench.state / "records.jsonl").entries}
    assert status["state"] == "done"
    client.stop()
    assert client.status()["state"] == "disarmed"


def test_stop_ramps_down_and_start_goes_on_with_the_record_that_was_not_finished(
    bench: FaultBench, client: Client
) -> None:
    client.arm()
    client.start(bench.sweep)
    bench.wait(lambda: client.status()["record"], "the record")
    client.stop()
    status = client.wait()
    assert status["state"] == "done"
    assert [job["state"] for job in status["queue"]][-1] == "stopped"
    client.start()
    bench.wait(lambda: client.status()["record"], "the same record again")
    client.stop()
    client.wait()


def test_after_an_emergency_stop_a_new_sweep_asks_before_the_old_queue_moves(bench: FaultBench, client: Client) -> None:
    client.arm()
    (old,) = client.start(bench.sweep)
    bench.wait(lambda: client.status()["record"], "the record")
    client.estop()
    bench.wait(lambda: client.status()["fault"], "the fault")
    bench.wait(lambda: not client.status()["working"], "the queue runner to hold")
    client.reset()
    assert any("the queue holds 1 sweep of before: long (1 of 1 records); 1 records" in line for line in client.arm())
    short = bench.folder / "short.yaml"
    with pytest.raises(StateError, match=r"the queue holds 1 sweep of before: long .*`pamrig start --only` leaves it"):
        client.start(short)
    assert not client.status()["working"]
    (new,) = client.start(short, before="leave")
    states = {job["id"]: job["state"] for job in client.wait()["queue"]}
    assert (states[old["id"]], states[new["id"]]) == ("stopped", "done")
    (third,) = client.start(short, before="first")
    status = bench.wait(lambda: (now := client.status())["record"] and now, "the old sweep again")
    assert status["record"]["name"].startswith("sine_0.5hz")
    assert {job["id"]: job["state"] for job in status["queue"]}[third["id"]] == "waiting"
    client.stop()
    client.wait()


def test_start_and_queue_say_what_moves_and_how_it_ended(bench: FaultBench, client: Client) -> None:
    client.arm()
    short, call = str(bench.folder / "short.yaml"), CliRunner().invoke
    done = call(cli_daemon.start, [short, "--wait", "--socket", str(bench.socket)])
    assert (done.exit_code, "short: done, 2 of 2 records" in done.output) == (0, True), done.output
    client.start(bench.sweep)
    bench.wait(lambda: client.status()["record"], "the record")
    client.stop()
    client.wait()
    shown = call(cli_daemon.queue, ["--socket", str(bench.socket)]).output
    assert "long" in shown
    assert "; held: `pamrig start` goes on" in shown
    refused = call(cli_daemon.start, [short, "--socket", str(bench.socket)])
    assert isinstance(refused.exception, StateError)
    on = call(cli_daemon.start, ["--socket", str(bench.socket)])
    assert on.output.startswith("going on with the queue: long (1 of 1 records); 60 s"), on.output
    bench.wait(lambda: client.status()["record"], "the record")
    client.stop()
    client.wait()


def test_stop_after_the_current_record(bench: FaultBench, client: Client) -> None:
    client.arm()
    (job,) = client.start(bench.folder / "short.yaml")
    bench.wait(lambda: client.status()["record"], "the record")
    client.stop(after_current=True)
    status = client.wait()
    (left,) = [one for one in status["queue"] if one["id"] == job["id"]]
    assert (left["state"], left["done"]) == ("stopped", 1)


def test_arming_moves_nothing(bench: FaultBench, client: Client) -> None:
    """Arming holds the measured pressures, which have come to the safe values after a while."""
    bench.wait(lambda: pressures(client) == pytest.approx(SAFE_MPA, abs=0.002), "the muscles to come to rest")
    before = bench.terminals.setpoints
    client.arm()
    time.sleep(0.1)
    assert bench.terminals.setpoints == pytest.approx(before, abs=0.003)


def test_after_an_emergency_stop_nothing_goes_before_a_reset_and_a_reset_does_not_arm(
    bench: FaultBench, client: Client
) -> None:
    client.estop()
    bench.wait(lambda: client.status()["fault"], "the fault")
    for command in (client.arm, lambda: client.start(bench.folder / "short.yaml"), client.stop):
        with pytest.raises(StateError, match=r"while fault: ESTOP; run `pamrig reset` first"):
            command()
    client.reset()
    assert client.status()["state"] == "disarmed"
    assert bench.terminals.setpoints == SAFE_MPA


# bad input: one clear answer each, the rig unmoved


def test_wrong_states_say_what_to_do(bench: FaultBench, client: Client) -> None:
    writes = bench.terminals.changed_ns
    with pytest.raises(StateError, match=r"cannot start while disarmed; run `pamrig arm` first"):
        client.start(bench.folder / "short.yaml")
    with pytest.raises(StateError, match="nothing to reset: the rig is disarmed"):
        client.reset()
    with pytest.raises(StateError, match="nothing to stop: nothing runs, and the rig is disarmed"):
        client.stop()
    assert bench.terminals.changed_ns == writes
    client.arm()
    with pytest.raises(StateError, match=r"armed already; `pamrig start` begins"):
        client.arm()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "records: [{sine: {frequency_hz: 1, amplitude_mpa: 0.9}}]",
            "^bad.yaml: sine_1hz_0.90mpa: set-point p2 would be",
        ),
        ("records: [{sin: {}}]", "expected one signal; did you mean 'sine'"),
        ("records: [", "not valid YAML"),
    ],
)
def test_a_sweep_that_does_not_fit_is_refused_whole(bench: FaultBench, client: Client, text: str, message: str) -> None:
    (bench.folder / "bad.yaml").write_text(text)
    client.arm()
    with pytest.raises(RigError, match=message):
        client.start(bench.folder / "short.yaml", bench.folder / "bad.yaml")
    status = client.status()
    assert status["state"] == "armed"
    assert not status["working"]


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


def test_a_second_daemon_with_the_same_state_folder_is_refused(bench: FaultBench, client: Client) -> None:
    command = [sys.executable, "-m", "rig.cli.main", "daemon", "--socket", str(bench.folder / "t.sock")]
    command += ["--logs", str(bench.folder / "other logs"), "--state", str(bench.state)]
    second = subprocess.run(command, capture_output=True, text=True, timeout=30, check=False)
    assert second.returncode == 2
    assert f"{bench.state}: another daemon is running with this state folder" in second.stderr


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


def test_the_socket_is_for_its_owner_only_unless_a_group_is_named(bench: FaultBench) -> None:
    assert bench.socket.stat().st_mode & 0o777 == 0o600


# looking


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

    assert ask(command="status", token=TOKEN)["result"]["state"] == "disarmed"
    assert ask(command="status")["error"] == {"code": "not_allowed", "message": "the token is missing or wrong"}
    assert ask(command="status", token=TOKEN[:-1] + "0")["error"]["code"] == "not_allowed"
    for command in ("arm", "estop", "reset", "start", "stop", "clear"):
        assert "not allowed over the network" in ask(command=command, token=TOKEN)["error"]["message"]
    assert client.status()["state"] == "disarmed"


def test_the_live_view_speaks_foxglove_s_protocol_and_sends_samples(
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

    channel, message = asyncio.run(look())
    assert (channel["encoding"], channel["schemaName"]) == ("protobuf", SAMPLE_SCHEMA)
    from rig.sample import SAMPLE_BYTES, unpack

    assert message[0] == 1  # message data: opcode, subscription id, log time, payload
    assert int.from_bytes(message[1:5], "little") == 5
    assert len(message) == 13 + SAMPLE_BYTES
    assert unpack(message[13:]).p1_cmd_mpa == pytest.approx(0.15)


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


# restarts


def test_a_restart_comes_back_disarmed_and_remembers_what_was_done(bench: FaultBench, client: Client) -> None:
    client.arm()
    (done,) = client.start(bench.folder / "short.yaml")
    client.wait()
    (cut,) = client.start(bench.sweep)
    bench.wait(lambda: client.status()["record"], "the record")
    client.close()
    assert bench.end() == 0
    assert bench.terminals.setpoints == SAFE_MPA
    bench.socket.write_text("")  # a stale file where the socket was
    bench.start()
    status = bench.status()
    jobs = {job["id"]: job for job in status["queue"]}
    assert (status["state"], status["working"]) == ("disarmed", False)
    assert (jobs[done["id"]]["state"], len(jobs[done["id"]]["files"])) == ("done", 2)
    assert jobs[cut["id"]]["state"] in ("stopped", "failed")
    assert not list(bench.state.glob("*.broken"))


def test_ended_daemons_leave_no_shared_memory(bench: FaultBench) -> None:
    session = bench.status()["session"]
    bench.end()
    assert not [name for name in os.listdir("/dev/shm") if session in name]
    bench.start()
