"""Other sites in the same browser as the operator's page, names that were made to point here, and markup where it does
not belong: none reads, stops or starts anything."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import urlsplit

import pytest
from support import browsers
from support.rigs.page_rig import MARKUP, armed, badge, part, says

from rig.qualify.faults.bench import FaultBench

pytest.importorskip("playwright")


ATTACKS = """<!doctype html><title>another site</title><iframe name="into"></iframe><script>
const victim = "VICTIM";
const got = [];
const tried = [];
const heard = (what) => () => got.push(what);
const body = JSON.stringify({sweeps: ["long"], text: "x"});
for (const path of ["stop", "api/command/take", "api/arm", "api/start", "api/reset", "api/mark", "api/clear"]) {
  for (const mode of ["no-cors", "cors"]) {
    tried.push(fetch(victim + path, {method: "POST", mode, credentials: "include", body})
      .then((answer) => { if (answer.type !== "opaque") got.push(path); }, () => {}));
  }
  const form = document.createElement("form");
  Object.assign(form, {method: "post", action: victim + path, target: "into"});
  document.body.append(form);
  form.submit();
}
for (const path of ["", "api/status", "api/sessions", "static/main.js"]) {
  tried.push(fetch(victim + path, {credentials: "include"}).then(heard("read " + path), () => {}));
}
const load = (tag, address, how) => tried.push(new Promise((over) => {
  const element = document.createElement(tag);
  element[how] = address;
  element.onload = () => { got.push(tag); over(); };
  element.onerror = over;
  document.body.append(element);
}));
load("script", victim + "static/dom.js", "src");
load("img", victim + "static/icon.svg", "src");
tried.push(new Promise((over) => {
  const socket = new WebSocket(victim.replace("http", "ws") + "live");
  socket.onmessage = () => { got.push("socket"); over(); };
  socket.onclose = over;
}));
const frame = document.createElement("iframe");
frame.src = victim;
document.body.append(frame);
Promise.all(tried).then(() => { document.title = got.length ? got.join() : "nothing"; });
</script>"""


@contextmanager
def another_site(page: str) -> Iterator[str]:
    """The same machine, another port: the nearest that a foreign page can come."""

    class Answer(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("Content-Type", "text/html; charset=utf-8")
            self.end_headers()
            self.wfile.write(page.encode())

        def log_message(self, format: str, *args: object) -> None:
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Answer)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        yield f"http://127.0.0.1:{server.server_port}/"
    finally:
        server.shutdown()
        server.server_close()


def test_another_site_in_the_operators_browser_neither_does_nor_reads_anything(
    page_bench: FaultBench, page: Any, page_url: str
) -> None:
    armed(page)
    queue = page_bench.status()["queue"]  # what another test left there, in an order that was drawn
    with another_site(ATTACKS.replace("VICTIM", page_url)) as elsewhere:
        other = page.context.new_page()  # with the cookie of who commands: ports are no sites
        other.goto(elsewhere)
        other.wait_for_function("document.title === 'nothing' || document.title.length > 20", timeout=20_000)
        assert other.title() == "nothing"
        assert all(frame.locator("#stop-button").count() == 0 for frame in other.frames[1:])
        other.close()
    status = page_bench.status()
    assert (status["state"], status["queue"], status["fault"]) == ("armed", queue, None)
    assert "You command" in page.inner_text("#commander")


def test_a_name_that_was_made_to_point_here_is_turned_away(chromium: Any, page_url: str) -> None:
    context = chromium.new_context()
    try:
        page = context.new_page()
        for path in ("", "api/status", "static/main.js"):
            answer = page.goto(f"http://{browsers.REBOUND}:{urlsplit(page_url).port}/{path}")
            assert answer.status == 421
    finally:
        context.close()


def test_the_browser_itself_refuses_what_the_page_did_not_bring(chromium: Any, page_url: str) -> None:
    """Markup that came through all the same would do nothing."""
    context = chromium.new_context()
    try:
        page = context.new_page()
        page.goto(page_url)
        badge(page, "ready")
        broken = page.evaluate(_INTRUDE)
        assert set(broken) == REFUSED
        assert page.title() != "hit"
    finally:
        context.close()


REFUSED = {
    "script-src-elem", "script-src-attr", "style-src-elem", "img-src", "connect-src", "form-action", "frame-src",
}  # fmt: skip
_INTRUDE = """async () => {
  const broken = [];
  document.addEventListener("securitypolicyviolation", (event) => broken.push(event.effectiveDirective));
  const put = (tag, properties) => document.body.append(Object.assign(document.createElement(tag), properties));
  put("script", { textContent: "document.title = 'hit'" });
  put("style", { textContent: "body { display: none }" });
  put("img", { src: "http://127.0.0.1:1/x.png" });
  put("iframe", { src: "http://127.0.0.1:1/" });
  const holder = document.createElement("div");
  holder.innerHTML = "<b onclick=\\"document.title='hit'\\">x</b><form action='http://127.0.0.1:1/'></form>";
  document.body.append(holder);
  holder.firstChild.click();
  holder.lastChild.submit();
  await fetch("http://127.0.0.1:1/").catch(() => {});
  for (let turn = 0; turn < 100 && broken.length < 7; turn++) await new Promise((over) => setTimeout(over, 20));
  return broken;
}"""


def test_markup_in_a_sweeps_name_is_text_from_the_list_to_the_queue(page_bench: FaultBench, page: Any) -> None:
    armed(page)
    part(page, "runs")
    page.select_option("#sweep", MARKUP)
    page.click("#queue-it:enabled")
    says(page, "queue", "img src=x")
    assert page.locator("#queue img").count() == 0
    page_bench.wait(lambda: page_bench.status()["queue"][-1]["done"] == 2, "two records")
    part(page, "records")
    says(page, "session", "img-src-x")  # a folder's name has none of it left
    part(page, "diagnosis")
    says(page, "diagnose-baselines", "img-src-x")
    assert page.locator("main img").count() == 0
    assert page.title() != "hit"
