"""Lines and requests made to hang, fill or break a running daemon and its page, by a seed.

    python tests/hostile_requests.py --seconds 3600 --seed 1

Each must be answered or hung up on within a time; no answer may be an error in the daemon itself; and every so often
the daemon must take an emergency stop and a status as if nothing had been.
"""

import contextlib
import json
import os
import random
import resource
import socket
import sys
import time
from collections.abc import Callable, Generator
from functools import partial
from pathlib import Path
from typing import Any

import hostile_configs
from support import hostile_work

from rig.qualify.faults.attacks import free_port
from rig.qualify.faults.bench import START_S, FaultBench
from rig.service.connections.protocol import COMMANDS

ANSWER_S = 20.0
"""For the answer to one input, on a machine that does other work too; a sweep may take the planner's time."""
SWEEP_S = 150.0
EVERY = 50
"""Inputs between two looks at the daemon."""
OURS = (b"error in the daemon itself", b"Internal Server Error", b"Traceback")
VALUES: list[Any] = [
    *hostile_configs.LEAVES, 0.5, 10, 50.0, 60, "first", "leave", "\ud800", "a\nb", ["a"] * 600, {"a": {"a": {"a": 1}}},
    ["/dev/zero"], ["/dev/null"], ["/proc/self/mem"], ["."], ["/"], ["\0"], ["~"], [["x"]], 10**18,
]  # fmt: skip
PATHS = [
    "/", "/login", "/stop", "/live", "/static/page.js", "/static/../../../etc/passwd", "/static/%2e%2e/%2e%2e/x",
    "/api/status", "/api/arm", "/api/start", "/api/ramp-down", "/api/reset", "/api/clear", "/api/mark",
    "/api/command/take", "/api/command/give-up", "/api/records", "/api/records/../../x/file",
    "/api/records/%2e%2e/%00/file", "/api/sweeps", "/api/queue", "/api/diagnoses", "/api/diagnoses/begin",
    "/diagnoses/x", "/diagnoses/%2e%2e", "/api/hunts", "/api/bring-up", "/api/bring-up/confirm", "/api/sweep?name=x",
    "/api/preview", "*", "//", "http://evil/", "/\xff", "/?" + "a=b&" * 900,
]  # fmt: skip
FIELDS = [
    "name", "by", "sweep", "sweeps", "text", "before", "after_current", "session", "model", "baselines", "step", "done",
    "token", "form_key", "from", "reference", "pause_s",
]  # fmt: skip
NO_LINES = [
    b"\n", b"\0\n", b"[" * 60_000 + b"\n", b'{"a":' * 9000 + b"\n", b"9" * 60_000 + b"\n", b"{}\n", b"\xff\xfe\n",
    b"x" * 70_000 + b"\n", b"GET / HTTP/1.1\r\n\r\n", b"1e999\n", b'{"v": NaN}\n',
]  # fmt: skip
METHODS = ["GET", "GET", "POST", "POST", "POST", "HEAD", "PUT", "DELETE", "OPTIONS", "TRACE", "X" * 300, "get"]
KINDS = ["application/json", "application/json", "application/x-www-form-urlencoded", "text/html", "\x7f"]
NO_BODIES = [
    b"[" * 9000, b"\xff" * 99, b"a=b&" * 50, b"x" * 20_000, b'{"a": 1e999}', b"9" * 5000, b'{"a": "\\ud800"}',
    b'{"form_key": "\\ud800", "token": "\\ud800"}',
]  # fmt: skip
HEADERS = [
    "Content-Length: -1", "Content-Length: 99999999999", "Content-Length: 5\r\nContent-Length: 6",
    "Transfer-Encoding: chunked", "Transfer-Encoding: gzip, chunked", "Cookie: pamrig=\xff; a=\"",
    "Cookie: " + "a=b; " * 900, "Origin: null", "Origin: http://[::1", "Origin: http://evil.example",
    "Host: evil.example", "Host: [::1", "Host: a\x00b", "Authorization: Bearer " + "x" * 5000, "Range: bytes=9-1",
    "Range: bytes=" + ",".join(f"{n}-{n}" for n in range(900)), "If-Modified-Since: 99",
    "Upgrade: websocket\r\nConnection: Upgrade", "Expect: 100-continue", "Sec-WebSocket-Key: x", "X: " + "y" * 60_000,
    ": novalue", "Accept: text/html", "Sec-Fetch-Site: cross-site", "Connection: close", "Content-Type: text/plain",
    "Content-Type: application/x-www-form-urlencoded", "Content-Type: multipart/form-data; boundary=",
]  # fmt: skip


def line(draw: random.Random, folder: Path) -> bytes:
    """One line for the control socket, or what is nearly one."""
    name = draw.choice([*COMMANDS, *COMMANDS, "", "estop ", "__class__", "x" * 3000])
    allowed = list(COMMANDS[name].arguments) if name in COMMANDS else []
    message: dict[str, Any] = {
        "v": draw.choice([1, 1, 1, 1, 1, 2, "1", None]),
        "id": draw.choice(VALUES),
        "command": name,
    }
    for _ in range(draw.choice([0, 1, 1, 2, 9])):
        message[draw.choice([*allowed, *allowed, *FIELDS])] = draw.choice(VALUES)
    if name == "start" and draw.random() < 0.5:
        message["sweeps"] = [str(sweep(draw, folder))]
    if name == "estop" and draw.random() < 0.5:
        message = {"v": 1, "id": 1, "command": "estop"}
    text = json.dumps(message, ensure_ascii=draw.random() < 0.5).encode("utf-8", "surrogatepass")
    match draw.randrange(8):
        case 0:
            return text[: draw.randrange(len(text))] + b"\n"
        case 1:
            return draw.choice(NO_LINES)
        case 2:
            return text + b"\n" + text + b"\r\n" + text * 3 + b"\n"
        case _:
            return text + b"\n"


def sweep(draw: random.Random, folder: Path) -> Path:
    """A sweep's file that something is wrong with."""
    path = folder / "hostile_sweep.yaml"
    sound = (hostile_configs.shipped.configs() / "sweeps" / "quick.yaml").read_text(encoding="utf-8")
    path.write_text(hostile_configs.changed_text(sound, draw), encoding="utf-8", errors="replace")
    return path


def request(draw: random.Random, port: int) -> bytes:
    """One request for the page, or what is nearly one."""
    method, kind, body = draw.choice(METHODS), draw.choice(KINDS), b""
    if method == "POST":
        given = {draw.choice(FIELDS): draw.choice(VALUES) for _ in range(draw.choice([0, 1, 2, 4, 30]))}
        body = json.dumps(draw.choice([given, given, given, [given], 1, None])).encode()
        body = draw.choice([body[:-1], *NO_BODIES]) if draw.random() < 0.2 else body
    head = [f"Host: 127.0.0.1:{port}", f"Origin: http://127.0.0.1:{port}", f"Content-Type: {kind}"]
    head += [draw.choice(HEADERS) for _ in range(draw.choice([0, 0, 0, 1, 2]))]
    if not any(text.startswith(("Content-Length", "Transfer")) for text in head):
        head.append(f"Content-Length: {len(body)}")
    head.append("Connection: close")
    first = f"{method} {draw.choice(PATHS)} HTTP/{draw.choice(['1.1', '1.1', '1.1', '1.0', '2', '9.9'])}"
    text = "\r\n".join([first, *head, "", ""]).encode("latin-1", "replace") + body
    return text if draw.random() < 0.9 else text[: draw.randrange(len(text))]


def answered(connection: socket.socket, data: bytes, patience_s: float) -> None:
    """Sent, and answered by something that is not our own mistake, or hung up on; then we hang up."""
    connection.settimeout(patience_s)
    said = b""
    with contextlib.suppress(ConnectionError):
        connection.sendall(data)
        if not data.endswith(b"\n") or b"HTTP" in data:
            connection.shutdown(socket.SHUT_WR)  # or it would wait for the rest
        said = connection.recv(65536)
    assert not any(words in said for words in OURS), said[:400]


class Target:
    """A daemon, what it has written so far, and whether it is as it was."""

    def __init__(self, bench: FaultBench) -> None:
        self.bench, self._read = bench, 0
        url = bench.wait(lambda: bench.status()["page"]["url"], "the page to be served", START_S)
        self.port = int(url.rpartition(":")[2].strip("/"))

    def try_line(self, data: bytes) -> float:
        """At the control socket."""
        begun = time.monotonic()
        with socket.socket(socket.AF_UNIX) as connection:
            connection.connect(str(self.bench.socket))
            answered(connection, data, SWEEP_S if b'"start"' in data else ANSWER_S)
        return time.monotonic() - begun

    def try_request(self, data: bytes) -> float:
        """At the page."""
        begun = time.monotonic()
        with socket.create_connection(("127.0.0.1", self.port), timeout=ANSWER_S) as connection:
            answered(connection, data, ANSWER_S)
        return time.monotonic() - begun

    def look(self) -> float:
        """It stops, answers, has the memory it had, and has complained of nothing that is its own."""
        begun = time.monotonic()
        with self.bench.client() as client:
            client.estop()
            spent_s = time.monotonic() - begun
            self.bench.wait(self.bench.fault, "the fault in the status")
            self.bench.wait(partial(_reset, client), "the reset")
            client.clear()
        said = self.bench.log_text()[self._read :].encode()
        self._read += len(said)
        assert not any(words in said for words in OURS), said[-2000:]
        return spent_s


def _reset(client: Any) -> bool:
    with contextlib.suppress(hostile_configs.RigError):
        client.reset()
        return True
    return False


def one(folder: Path, seed: int) -> Generator[tuple[float, int, Callable[[], float]], None, None]:
    """For `hostile_work`: the time allowed, the size, and the work, of one input after the other."""
    resource.setrlimit(resource.RLIMIT_AS, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))  # of the daemon, too
    draw = random.Random(f"requests {seed}")
    settings = folder / "daemon.yaml"
    settings.write_text(f"web: {{port: {free_port()}, sweeps: [{folder}]}}\n", encoding="utf-8")
    with FaultBench(folder, arguments=("--config", str(settings)), web=True) as bench:
        bench.start()
        target = Target(bench)
        while True:
            for _ in range(EVERY):
                if draw.random() < 0.5:
                    data, work = line(draw, folder), target.try_line
                else:
                    data, work = request(draw, target.port), target.try_request
                (folder / f"input_{os.getpid()}").write_bytes(data)
                yield ANSWER_S, len(data), partial(work, data)
            yield ANSWER_S, 0, target.look


if __name__ == "__main__":
    sys.exit(hostile_work.main("hostile_requests", __doc__ or ""))
