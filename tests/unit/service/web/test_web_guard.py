"""What the page answers to whom, over the network with a token and on the loopback without one: the application itself,
without sockets. No daemon listens behind it, so nothing that gets through does anything."""

import asyncio
import contextlib
import html
import json
import socket
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

import pytest
from starlette.requests import Request

from rig.app import compose, shipped
from rig.service.web.access.visitors import COOKIE, GUESSES, LASTS_S, Guesses, Visitors
from rig.service.web.page_setup import PageSetup
from rig.service.web.routes.pages import Pages
from rig.service.web.site import Site

TOKEN = "0123456789abcdef"
HERE = "192.168.1.5:8420"
OWN = {"host": HERE, "origin": f"http://{HERE}"}


@dataclass
class Answer:
    status: int = 0
    headers: dict[str, str] = field(default_factory=dict)
    body: bytes = b""


def ask(
    site: Site, path: str, headers: dict[str, str] | None = None, *, method: str = "GET", body: bytes = b"",
    kind: str = "http", address: str = "192.168.1.9",
) -> Answer:  # fmt: skip
    """One request as the server would pass it on."""
    path, _, query = path.partition("?")
    scope: dict[str, Any] = {
        "type": kind, "method": method, "path": path, "raw_path": path.encode(), "query_string": query.encode(),
        "headers": [(k.encode("latin-1"), v.encode("latin-1")) for k, v in ({"host": HERE} | (headers or {})).items()],
        "client": (address, 40000), "server": ("192.168.1.5", 8420), "scheme": "http", "http_version": "1.1",
        "root_path": "", "subprotocols": [],
    }  # fmt: skip
    sent = [{"type": "http.request", "body": body, "more_body": False}]
    answer = Answer()

    async def receive() -> dict[str, Any]:
        if kind == "websocket":
            return {"type": "websocket.connect"}
        return sent.pop() if sent else {"type": "http.disconnect"}

    async def send(message: dict[str, Any]) -> None:
        if message["type"] == "http.response.start":
            answer.status = message["status"]
            answer.headers = {k.decode().lower(): v.decode("latin-1") for k, v in message["headers"]}
        elif message["type"] == "http.response.body":
            answer.body += message.get("body", b"")
        elif message["type"] == "websocket.close":
            answer.status = message["code"]
        elif message["type"] == "websocket.accept":
            answer.status = 101
            raise ConnectionAbortedError

    async def one() -> None:
        with contextlib.suppress(ConnectionAbortedError):
            await asyncio.wait_for(site.app(scope, receive, send), 5)

    asyncio.run(one())
    return answer


def site_of(tmp_path: Path, *, local: bool, token: str = "", names: tuple[str, ...] = ()) -> Site:
    rig = compose.load(None)
    return Site(
        PageSetup(
            tmp_path / "none.sock", rig, True, tmp_path, tmp_path, local, sweeps=(shipped.configs() / "sweeps",),
            names=names, token=token, key=b"k" * 32,
        )
    )  # fmt: skip


@pytest.fixture
def networked(tmp_path: Path) -> Site:
    return site_of(tmp_path, local=False, token=TOKEN, names=("rig.lab",))


@pytest.fixture
def local(tmp_path: Path) -> Site:
    return site_of(tmp_path, local=True)


def log_in(site: Site, token: str = TOKEN, address: str = "192.168.1.9") -> Answer:
    form = {"content-type": "application/x-www-form-urlencoded"}
    return ask(site, "/login", OWN | form, method="POST", body=urlencode({"token": token}).encode(), address=address)


def cookie_of(answer: Answer) -> dict[str, str]:
    return {"cookie": answer.headers["set-cookie"].partition(";")[0]}


# the token


def test_without_the_token_there_is_only_the_page_that_asks_for_it(networked: Site) -> None:
    assert ask(networked, "/").headers["location"] == "/login"
    assert b"token" in ask(networked, "/login").body
    for path in ("/api/status", "/api/records", "/live"):
        assert ask(networked, path).status == 401
    for path in ("/stop", "/api/arm", "/api/command/take"):
        assert ask(networked, path, OWN, method="POST").status == 401
    assert ask(networked, "/live", OWN, kind="websocket").status == 4403


def test_with_the_token_one_comes_in_and_a_program_may_show_it_each_time(networked: Site) -> None:
    known = log_in(networked)
    assert known.status == 303
    assert "HttpOnly" in known.headers["set-cookie"]
    assert "SameSite=Strict" in known.headers["set-cookie"]
    assert TOKEN not in known.headers["set-cookie"]
    assert ask(networked, "/api/status", cookie_of(known)).status == 200
    assert ask(networked, "/live", OWN | cookie_of(known), kind="websocket").status == 101
    assert ask(networked, "/api/status", {"authorization": f"Bearer {TOKEN}"}).status == 200
    assert ask(networked, "/api/status", {"authorization": "Bearer wrong"}).status == 401


def test_a_login_grows_old_by_a_clock_that_nobody_turns(networked: Site, monkeypatch: pytest.MonkeyPatch) -> None:
    """The machine's date may be set forward by months while somebody has the page open, and Stop goes through it."""
    known, real, later_s = cookie_of(log_in(networked)), time.monotonic, 0.0
    monkeypatch.setattr(time, "monotonic", lambda: real() + later_s)
    later_s = LASTS_S - 60.0
    assert ask(networked, "/stop", OWN | known, method="POST").status != 401
    later_s = LASTS_S + 60.0
    assert ask(networked, "/stop", OWN | known, method="POST").status == 401


def test_guessing_is_limited_at_both_ways_in_and_the_right_token_must_wait_too(networked: Site) -> None:
    for _ in range(GUESSES):
        assert ask(networked, "/api/status", {"authorization": "Bearer wrong"}).status == 401
    assert log_in(networked).status == 429
    assert ask(networked, "/api/status", {"authorization": f"Bearer {TOKEN}"}).status == 401
    assert log_in(networked, address="192.168.1.10").status == 303


def test_a_wrong_token_is_told_so(networked: Site) -> None:
    refused = log_in(networked, "not the token")
    assert refused.status == 403
    assert b"This is not the token" in refused.body
    assert "set-cookie" not in refused.headers or "." not in refused.headers["set-cookie"].partition(".1.")[1]


def test_half_a_character_for_a_token_is_no_error_of_the_page(networked: Site) -> None:
    as_json = OWN | {"content-type": "application/json"}
    assert ask(networked, "/login", as_json, method="POST", body=b'{"token": "\\ud800"}').status == 400


# other sites


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:8420", "127.0.0.1.evil.example", "", "[", "rig.lab.evil"]
)
def test_a_name_that_is_not_ours_leads_nowhere(local: Site, host: str) -> None:
    for path in ("/", "/api/status", "/static/main.js"):
        assert ask(local, path, {"host": host}).status == 421
    assert ask(local, "/stop", {"host": host, "origin": f"http://{host}"}, method="POST").status == 421
    assert ask(local, "/live", {"host": host, "origin": f"http://{host}"}, kind="websocket").status == 4403


@pytest.mark.parametrize("host", ["127.0.0.1:9", "localhost", "[::1]:8420", socket.gethostname(), "RIG.LAB:8420"])
def test_addresses_and_our_names_lead_here(networked: Site, host: str) -> None:
    assert ask(networked, "/login", {"host": host}).status == 200


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "null", "http://192.168.1.5:9999", "http://192.168.1.5", "", "x", "http://[::1"]
)
@pytest.mark.parametrize("path", ["/stop", "/api/arm", "/api/start", "/api/command/take", "/login"])
def test_another_site_cannot_send_anything(local: Site, origin: str, path: str) -> None:
    assert ask(local, path, {"origin": origin}, method="POST").status == 403


def test_another_site_cannot_listen_or_read(local: Site) -> None:
    assert ask(local, "/live", {"origin": "http://evil.example"}, kind="websocket").status == 4403
    assert ask(local, "/live", {"origin": "http://[::1"}, kind="websocket").status == 4403
    assert ask(local, "/live", kind="websocket").status == 4403
    for site in ("cross-site", "same-site"):
        assert ask(local, "/api/status", {"sec-fetch-site": site, "sec-fetch-mode": "no-cors"}).status == 403
        assert ask(local, "/", {"sec-fetch-site": site, "sec-fetch-mode": "navigate"}).status == 200
    assert "access-control-allow-origin" not in ask(local, "/api/status", {"origin": "http://evil.example"}).headers


def test_a_form_of_ours_stops_where_the_browser_says_no_origin(local: Site) -> None:
    front = ask(local, "/")
    key = front.body.partition(b'name="form_key" value="')[2].partition(b'"')[0].decode()
    form = {"content-type": "application/x-www-form-urlencoded"} | cookie_of(front)
    stopped = ask(local, "/stop", form, method="POST", body=urlencode({"form_key": key, "from": "form"}).encode())
    assert stopped.headers["location"] == "/?stopped=no"  # it came through; there is no daemon that could stop anything
    for wrong in ("", key[:-1], key[::-1]):
        body = urlencode({"form_key": wrong}).encode()
        assert ask(local, "/stop", form, method="POST", body=body).status == 403
    another = ask(local, "/")
    body = urlencode({"form_key": key}).encode()
    assert ask(local, "/stop", form | cookie_of(another), method="POST", body=body).status == 403


# bodies


@pytest.mark.parametrize(
    ("kind", "body", "status"),
    [
        ("multipart/form-data; boundary=x", b"--x\r\n", 415),
        ("application/octet-stream", b"\0" * 10, 415),
        ("application/json", b"{" * 9000, 400),
        ("application/json", b"[1, 2]", 400),
        ("application/json", b'{"form_key"', 400),
        ("application/json", b'{"form_key": "\\ud800"}', 400),
        ("application/x-www-form-urlencoded", b"a=1&" * 1000, 400),
        ("application/json", b" " * 20_000, 413),
    ],
)
def test_what_no_form_of_ours_sends_is_refused(local: Site, kind: str, body: bytes, status: int) -> None:
    for path in ("/stop", "/api/start", "/api/mark"):
        assert ask(local, path, OWN | {"content-type": kind}, method="POST", body=body).status == status


@pytest.mark.parametrize("method", ["PUT", "DELETE", "PATCH", "OPTIONS", "TRACE", "CONNECT"])
def test_nothing_is_uploaded_removed_or_allowed_to_others(local: Site, method: str) -> None:
    paths = ("/", "/stop", "/api/status", "/api/start", "/api/records/day/a.mcap/file", "/static/main.js", "/static/x")
    for path in paths:
        refused = ask(local, path, OWN, method=method, body=b"x")
        assert refused.status in (404, 405)
        assert not any(name.startswith("access-control") for name in refused.headers)
        assert ask(local, path, {"origin": "http://evil.example"}, method=method).status == 403


@pytest.mark.parametrize(
    "given",
    [{"sweeps": ["../../../etc/passwd"]}, {"sweeps": ["/etc/passwd"]}, {"sweeps": "quick"}, {"sweeps": [7]},
     {"sweeps": ["quick"], "pause_s": "soon"}, {"sweeps": ["quick"], "pause_s": "1e999"}],
)  # fmt: skip
def test_a_start_with_what_is_not_offered_is_one_line(local: Site, given: dict[str, Any]) -> None:
    front = ask(local, "/")
    own = OWN | cookie_of(front) | {"content-type": "application/json"}
    assert ask(local, "/api/command/take", own, method="POST").status == 200
    answer = ask(local, "/api/start", own, method="POST", body=json.dumps(given).encode())
    assert answer.status in (400, 409)
    assert b"Traceback" not in answer.body
    assert len(answer.body) < 300


# what every answer says


@pytest.mark.parametrize("path", ["/", "/login", "/api/status", "/static/main.js", "/nothing", "/static/../site.py"])
def test_every_answer_is_strict_about_what_a_browser_may_do(local: Site, path: str) -> None:
    said = ask(local, path).headers
    policy = said["content-security-policy"]
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy
    assert "frame-ancestors 'none'" in policy
    assert (said["x-content-type-options"], said["x-frame-options"]) == ("nosniff", "DENY")


def test_the_pages_hold_no_script_or_style_of_their_own_and_nothing_from_elsewhere(local: Site) -> None:
    for path in ("/", "/login"):
        text = ask(local, path).body.decode()
        assert "<style" not in text
        assert " style=" not in text
        assert " onclick" not in text
        assert "<script>" not in text
        assert "//" not in text.replace("<!doctype html>", "")


def test_markup_in_what_the_daemon_says_is_text_without_scripts_too(local: Site) -> None:
    markup = "<script>alert(1)</script>"
    shown = {"rig": markup, "badge": markup, "means": markup, "simulated": False, "safe_state": {"words": markup}}
    fault = {"name": markup, "cause": markup, "said": markup, "hint": markup}
    visitors, units = Visitors(b"k" * 32, ""), {"valves": False, "input": markup, "output": f'"{markup}'}

    async def nothing() -> None: ...

    pages = Pages(visitors, Guesses(), nothing, lambda: shown | {"fault": fault}, units)
    scope = {
        "type": "http",
        "method": "GET",
        "headers": [],
        "query_string": b"",
        "visitor": visitors.new(trusted=False),
    }
    text = bytes(asyncio.run(pages.front(Request(scope))).body).decode()
    assert "<script>" not in text
    assert text.count("&lt;script&gt;") >= 10
    assert json.loads(html.unescape(text.partition('data-units="')[2].partition('"')[0])) == units


@pytest.mark.parametrize(
    "path", ["/static/../site.py", "/static/%2e%2e/site.py", "/static//etc/passwd", "/static/..%2fsite.py"]
)
def test_no_path_leads_out_of_the_folder(local: Site, path: str) -> None:
    assert ask(local, path).status == 404


def test_a_cookie_that_is_none_is_no_trouble(local: Site) -> None:
    for cookie in (f"{COOKIE}=", f"{COOKIE}=a.b.c.d", "=;=", f"{COOKIE}=\xff", "x" * 5000):
        assert ask(local, "/", {"cookie": cookie}).status == 200
