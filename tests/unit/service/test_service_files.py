"""What is installed and opened beside the daemon: unit file, System V script, settings, Foxglove layout,
notifications."""

import json
import os
import pwd
import shutil
import socket
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import pytest
from click.testing import CliRunner

from hil.terminals import Terminals
from rig.app import installing, shipped
from rig.cli.service.install import service
from rig.config import load
from rig.errors import ConfigError, RigError
from rig.log.mcap.schema import LOG_TOPIC, SAMPLE_TOPIC
from rig.qualify.faults.bench import RIG
from rig.sample import WIRES
from rig.service.settings import DaemonSettings, default_state_folder, load_settings, read_token
from rig.service.views import metrics
from rig.service.views.notify import Notifier


def install(root: Path, *arguments: str) -> str:
    outcome = CliRunner().invoke(service, ["install", "--root", str(root), *arguments], catch_exceptions=False)
    assert outcome.exit_code == 0
    return outcome.output


# installing


def test_the_systemd_unit_is_installed_with_nothing_left_to_fill_in(tmp_path: Path) -> None:
    said = install(tmp_path, "--init", "systemd")
    unit = (tmp_path / "etc/systemd/system/pamrig.service").read_text()
    assert "{" not in unit
    for line in ("Type=notify", "WatchdogSec=2", "KillMode=mixed", "LimitRTPRIO=95", "LimitMEMLOCK=infinity"):
        assert line in unit
    assert "service safe --rig" in next(line for line in unit.splitlines() if line.startswith("ExecStopPost="))
    assert "settings:" in said
    assert "service:" in said


def test_systemd_itself_finds_nothing_wrong_with_the_unit(tmp_path: Path) -> None:
    analyze = shutil.which("systemd-analyze")
    if analyze is None:
        pytest.skip("systemd-analyze is not installed here")
    install(tmp_path, "--init", "systemd")
    unit = tmp_path / "etc/systemd/system/pamrig.service"
    checked = subprocess.run([analyze, "verify", "--man=no", str(unit)], capture_output=True, text=True, check=False)
    assert "pamrig.service" not in checked.stderr


ODD: Final = 'a lab\'s 50 %n "rig" $HOME; x'
"""The name of a folder."""


def test_systemd_reads_places_with_odd_names_as_they_are(tmp_path: Path) -> None:
    """A blank parted the rig's path in two, in the line that writes the safe state too."""
    unit = installing.render(
        installing.SYSTEMD, "/usr/bin/pamrig", Path(f"/{ODD}/rig.yaml"), Path("/etc/d.yaml"), [Path(f"/{ODD}")]
    )
    spelt = '"/a lab\'s 50 %%n \\"rig\\" $$HOME; x/rig.yaml"'
    assert f"ExecStart=/usr/bin/pamrig daemon --rig {spelt} --config /etc/d.yaml\n" in unit
    assert f"ExecStopPost=/usr/bin/pamrig service safe --rig {spelt}\n" in unit
    assert 'ReadWritePaths="/a lab\'s 50 %%n \\"rig\\" $HOME; x"\n' in unit
    if analyze := shutil.which("systemd-analyze"):
        (tmp_path / "odd.service").write_text(unit.replace("/usr/bin/pamrig", "/bin/true"))
        told = subprocess.run(
            [analyze, "verify", "--man=no", str(tmp_path / "odd.service")], capture_output=True, text=True, check=False
        )
        assert "odd.service" not in told.stderr


def test_the_system_v_script_calls_with_odd_names_as_they_are(tmp_path: Path) -> None:
    (tmp_path / ODD).mkdir()
    pamrig = tmp_path / ODD / "pamrig"
    pamrig.write_text("#!/bin/sh\nfor word; do printf '<%s>' \"$word\"; done\n")
    pamrig.chmod(0o755)
    text = installing.render(installing.SYSV, str(pamrig), tmp_path / ODD / "rig.yaml", Path("/etc/d.yaml"), [tmp_path])
    (tmp_path / "script").write_text(text.replace("start-stop-daemon", "true"))
    told = subprocess.run(["sh", str(tmp_path / "script"), "stop"], capture_output=True, text=True, check=True)
    assert told.stdout == f"<service><safe><--rig><{tmp_path / ODD / 'rig.yaml'}>"


@pytest.mark.parametrize("init", installing.INITS.values(), ids=installing.INITS)
def test_a_service_is_not_installed_for_a_place_that_breaks_its_line(init: installing.Init) -> None:
    with pytest.raises(RigError, match="a service cannot be told of a place with such a character"):
        installing.render(init, "/usr/bin/pamrig", Path("/a\nExecStartPre=b"), Path("/etc/d.yaml"), [Path("/logs")])


@pytest.mark.parametrize("init", installing.INITS.values(), ids=installing.INITS)
def test_a_place_that_is_called_as_one_of_the_template_is_no_other(init: installing.Init) -> None:
    """The rig of another file would have been served, and made safe."""
    text = installing.render(init, "/opt/pamrig", Path("/{config}/{folders}.yaml"), Path("/etc/d.yaml"), [Path("/l")])
    assert text.count("/{config}/{folders}.yaml") == 2


def test_the_service_may_write_to_each_folder_that_its_settings_name(tmp_path: Path) -> None:
    """The unit opened the records alone: a daemon with its state in a home could not write its queue. Names are
    relative to the folder that a service starts in."""
    (tmp_path / "etc/pamrig").mkdir(parents=True)
    settings = "logs: records\nstate: /home/lab/state\nmetrics: /usr/local/prom/pamrig.prom\n"
    (tmp_path / "etc/pamrig/daemon.yaml").write_text(settings)
    install(tmp_path, "--init", "systemd")
    unit = (tmp_path / "etc/systemd/system/pamrig.service").read_text()
    assert "ReadWritePaths=/records /home/lab/state /usr/local/prom\n" in unit
    made = installing.after_install(installing.SYSTEMD, load_settings(tmp_path / "etc/pamrig/daemon.yaml"))
    assert ["mkdir", "-p", "/records", "/home/lab/state", "/usr/local/prom"] in made


def test_the_system_v_script_is_a_script(tmp_path: Path) -> None:
    install(tmp_path, "--init", "sysv")
    script = tmp_path / "etc/init.d/pamrig"
    assert script.stat().st_mode & 0o111
    subprocess.run(["sh", "-n", str(script)], check=True)
    usage = subprocess.run(["sh", str(script)], capture_output=True, text=True, check=False)
    assert usage.returncode == 1
    assert "usage:" in usage.stderr


def test_settings_that_are_there_already_are_kept(tmp_path: Path) -> None:
    (tmp_path / "etc/pamrig").mkdir(parents=True)
    (tmp_path / "etc/pamrig/daemon.yaml").write_text("keep_days: 3\n")
    assert "kept as it is" in install(tmp_path, "--init", "systemd")
    assert (tmp_path / "etc/pamrig/daemon.yaml").read_text() == "keep_days: 3\n"


def test_a_dry_run_changes_nothing(tmp_path: Path) -> None:
    install(tmp_path, "--dry-run", "--init", "systemd")
    assert list(tmp_path.iterdir()) == []


def test_uninstall_takes_away_what_was_installed_and_says_when_there_is_nothing(tmp_path: Path) -> None:
    install(tmp_path, "--init", "sysv")
    arguments = ["uninstall", "--root", str(tmp_path), "--init", "sysv"]
    CliRunner().invoke(service, arguments, catch_exceptions=False)
    assert not (tmp_path / "etc/init.d/pamrig").exists()
    assert isinstance(CliRunner().invoke(service, arguments).exception, RigError)


def test_safe_needs_no_daemon() -> None:
    outcome = CliRunner().invoke(service, ["safe"], catch_exceptions=False)
    assert outcome.output == "simulated: nothing to write: its plant lives in the loop's process, and ends with it\n"


def test_safe_says_whether_it_was_seen_at_the_device(tmp_path: Path) -> None:
    terminals = Terminals.at(tmp_path / "terminals")
    terminals.write(0.3, 0.1)
    model = shipped.configs() / "models" / "simulated.yaml"
    (tmp_path / "rig.yaml").write_text(RIG.format(model=model, terminals=tmp_path / "terminals"))
    outcome = CliRunner().invoke(service, ["safe", "--rig", str(tmp_path / "rig.yaml")], catch_exceptions=False)
    assert outcome.output == "faulty: safe, 0.15 and 0.15 MPa, seen at the device\n"
    assert terminals.setpoints == (0.15, 0.15)


# settings


def test_the_shipped_settings_are_valid_and_open_nothing_to_the_network() -> None:
    settings = load_settings(shipped.configs() / "daemon.yaml")
    assert (settings.live.port, settings.view.port) == (0, 0)
    assert not settings.force
    assert (DaemonSettings().live.port, DaemonSettings().view.port) == (0, 0)


def test_a_view_without_a_token_is_refused(tmp_path: Path) -> None:
    (tmp_path / "d.yaml").write_text("view: {port: 4000}")
    with pytest.raises(ConfigError, match=r"view.token_file: needed with view.port"):
        load_settings(tmp_path / "d.yaml")


def test_an_unknown_setting_is_refused(tmp_path: Path) -> None:
    (tmp_path / "d.yaml").write_text("keep_day: 4")
    with pytest.raises(ConfigError, match="unknown key 'keep_day'; did you mean 'keep_days'"):
        load(tmp_path / "d.yaml", DaemonSettings)


# the layout


def test_the_layout_shows_fields_that_exist_and_every_panel_it_configures() -> None:
    layout = json.loads((shipped.configs() / "layouts" / "pamrig.json").read_text())
    assert sorted(panels(layout["layout"])) == sorted(layout["configById"])
    shown = [value for config in layout["configById"].values() for value in paths(config)]
    assert len(shown) > 8
    assert {value.removeprefix(f"{SAMPLE_TOPIC}.") for value in shown} <= set(WIRES)
    assert layout["configById"]["RosOut!log"]["topicToRender"] == LOG_TOPIC


def panels(node: Any) -> Iterator[str]:
    if isinstance(node, str):
        yield node
        return
    yield from panels(node["first"])
    yield from panels(node["second"])


def paths(config: dict[str, Any]) -> list[str]:
    every = [*config.get("paths", []), *([config["xAxisPath"]] if "xAxisPath" in config else [])]
    return [path["value"] for path in every]


# systemd's watchdog


def test_notifications_go_where_systemd_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as systemd:
        systemd.bind(str(tmp_path / "notify"))
        monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "notify"))
        monkeypatch.setenv("WATCHDOG_USEC", "2000000")
        notifier = Notifier()
        assert notifier.watchdog_s == 2.0
        notifier.say(READY=1, STATUS="armed")
        assert systemd.recv(100) == b"READY=1\nSTATUS=armed"
    notifier.say(WATCHDOG=1)  # nobody listens any more: no error
    notifier.close()


def test_without_systemd_nothing_is_sent(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("NOTIFY_SOCKET", "WATCHDOG_USEC"):
        monkeypatch.delenv(name, raising=False)
    notifier = Notifier()
    notifier.say(READY=1)
    assert notifier.watchdog_s is None


def test_a_watchdog_that_is_meant_for_another_process_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("WATCHDOG_USEC", "2000000")
    monkeypatch.setenv("WATCHDOG_PID", "1")
    assert Notifier().watchdog_s is None


# what the daemon knows from the ring


def test_metrics_take_the_place_of_metrics_only(tmp_path: Path) -> None:
    pytest.importorskip("prometheus_client")
    for name, text in {"rec.mcap": "\x89MCAP0\r\n", "model.yaml": "muscle:\n  kind: mbw\n"}.items():
        (tmp_path / name).write_text(text)
        with pytest.raises(RigError, match="is not overwritten"):
            metrics.check_usable(tmp_path / name)
    with pytest.raises(RigError, match="not a regular file"):  # it would no longer be a device
        metrics.check_usable(Path("/dev/null"))
    metrics.check_usable(tmp_path / "pamrig.prom")


def test_a_user_without_a_home_has_a_state_folder_beside_the_logs(monkeypatch: pytest.MonkeyPatch) -> None:
    """In a container, by its number alone: the daemon ended in a traceback, also where --state said the place."""

    def nobody(_: int) -> None:
        raise KeyError

    for name in ("HOME", "XDG_STATE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(os, "getuid", lambda: 12345)
    monkeypatch.setattr(pwd, "getpwuid", nobody)
    assert default_state_folder() == Path("pamrig-state")
    assert load_settings(None).state == Path("pamrig-state")


@pytest.mark.parametrize(("held", "said"), [
    (b"\xff" * 20, "it is not UTF-8 text"), (b"x" * 5000, "it has 5000 bytes"), (None, "no such file"),
])  # fmt: skip
def test_a_token_that_cannot_be_read_is_one_line(tmp_path: Path, held: bytes | None, said: str) -> None:
    if held is not None:
        (tmp_path / "token").write_bytes(held)
    with pytest.raises(RigError) as error:
        read_token(tmp_path / "token")
    assert str(error.value).startswith(f"the token cannot be read: {tmp_path / 'token'}: ")
    assert said in str(error.value)
