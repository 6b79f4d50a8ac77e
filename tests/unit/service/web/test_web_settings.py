"""The page's settings: short forms, and what the network needs."""

from pathlib import Path

import pytest

from rig.errors import ConfigError
from rig.service.settings import Web, load_settings, parse_web


def settings(tmp_path: Path, text: str) -> Web:
    path = tmp_path / "daemon.yaml"
    path.write_text(text)
    return load_settings(path).web


def test_it_is_on_by_itself_on_the_loopback_and_off_by_one_word(tmp_path: Path) -> None:
    assert settings(tmp_path, "spare_gb: 1.0") == Web()
    assert Web().on
    assert Web().local
    assert not settings(tmp_path, "web: false").on
    assert not settings(tmp_path, "web: {on: false}").on
    assert settings(tmp_path, "web: true").on
    assert settings(tmp_path, "web: {port: 9000}").port == 9000


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.168.1.5", "rig-3"])
def test_the_network_needs_a_token(tmp_path: Path, host: str) -> None:
    with pytest.raises(ConfigError, match="token_file"):
        settings(tmp_path, f"web: {{host: '{host}'}}")
    assert not settings(tmp_path, f"web: {{host: '{host}', token_file: token}}").local


def test_a_host_of_control_codes_does_not_reach_the_message_as_such(tmp_path: Path) -> None:
    with pytest.raises(ConfigError) as caught:
        settings(tmp_path, 'web: {host: "\\e[2Jx"}')
    assert str(caught.value).isprintable()


@pytest.mark.parametrize(
    ("text", "host"), [("127.0.0.1:9000", "127.0.0.1"), ("[::1]:9000", "::1"), ("localhost:9000", "localhost")]
)
def test_the_option_is_host_and_port(text: str, host: str) -> None:
    web = parse_web(text, Web(on=False))
    assert (web.on, web.host, web.port, web.local) == (True, host, 9000, True)


def test_the_option_turns_it_off() -> None:
    assert not parse_web("off", Web()).on


@pytest.mark.parametrize(
    "text", ["", "9000", ":9000", "127.0.0.1:", "127.0.0.1:0", "127.0.0.1:70000", "127.0.0.1:x", "a:²", "0.0.0.0:80"]
)
def test_anything_else_is_one_line(text: str) -> None:
    with pytest.raises(ConfigError) as caught:
        parse_web(text, Web())
    assert "\n" not in str(caught.value)
    assert "--web" in str(caught.value)


@pytest.mark.parametrize(
    "text", ["web: 3", "web: {prot: 80}", "web: {port: 0}", "web: {port: 1.5}", "web: {names: rig}"]
)
def test_a_mistake_in_the_file_is_one_line(tmp_path: Path, text: str) -> None:
    with pytest.raises(ConfigError, match="web"):
        settings(tmp_path, text)
