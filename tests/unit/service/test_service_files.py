"""What is installed and opened beside the daemon: unit file, System V script, settings, Foxglove layout, notifications,
the picture."""

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
from rich.console import Console

from hil.terminals import Terminals
from rig.app import installing, shipped
from rig.channels import PNEUMATIC
from rig.cli.service.install import service
from rig.cli.service.watch import WINDOW_S, Window, act, lateness_bars, picture
from rig.config import load
from rig.errors import ConfigError, RigError
from rig.log.mcap.schema import LOG_TOPIC, SAMPLE_TOPIC
from rig.qualify.faults.bench import RIG
from rig.realtime.ring import Ring, RingWriter
from rig.sample import WIRES, Sample
from rig.service.session.telemetry import LATENESS_EDGES_US, Telemetry
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
        installing.SYSTEMD, "/usr/bin/pamrig", Path(f"/{ODD}/rig.yaml"), Path("/etc/d.yaml"), Path(f"/{ODD}")
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
    text = installing.render(installing.SYSV, str(pamrig), tmp_path / ODD / "rig.yaml", Path("/etc/d.yaml"), tmp_path)
    (tmp_path / "script").write_text(text.replace("start-stop-daemon", "true"))
    told = subprocess.run(["sh", str(tmp_path / "script"), "stop"], capture_output=True, text=True, check=True)
    assert told.stdout == f"<service><safe><--rig><{tmp_path / ODD / 'rig.yaml'}>"


@pytest.mark.parametrize("init", installing.INITS.values(), ids=installing.INITS)
def test_a_service_is_not_installed_for_a_place_that_breaks_its_line(init: installing.Init) -> None:
    with pytest.raises(RigError, match="a service cannot be told of a place with such a character"):
        installing.render(init, "/usr/bin/pamrig", Path("/a\nExecStartPre=b"), Path("/etc/d.yaml"), Path("/logs"))


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


@pytest.fixture
def ring(request: pytest.FixtureRequest) -> Iterator[Ring]:
    ring = Ring.create(f"test-telemetry-{id(request)}", 1, 64)
    yield ring
    ring.block.unlink()


def put(writer: RingWriter, tick: int, late_us: int = 0, **fields: int) -> None:
    zeros = dict.fromkeys(Sample._fields, 0)
    writer.put(Sample(**(zeros | {"tick": tick, "woken_ns": late_us * 1000} | fields)))


def test_lateness_falls_into_its_class(ring: Ring) -> None:
    telemetry, writer = Telemetry(ring), RingWriter(ring, 1)
    for tick, late_us in enumerate((5, 10, 11, 600, 9000)):
        put(writer, tick, late_us)
    telemetry.update()
    shown = telemetry.lateness()
    classes = dict(zip([*LATENESS_EDGES_US, "above"], shown["histogram"], strict=True))
    assert {edge: count for edge, count in classes.items() if count} == {10: 2, 20: 1, 1000: 1, "above": 1}
    assert shown["max"] == 9000


def test_the_first_sample_of_a_fault_is_kept_until_it_is_cleared(ring: Ring) -> None:
    telemetry, writer = Telemetry(ring), RingWriter(ring, 1)
    for tick, fault in enumerate((0, 6, 6, 6)):
        put(writer, tick, fault=fault)
    telemetry.update()
    assert telemetry.first_fault is not None
    assert telemetry.first_fault.tick == 1
    put(writer, 4)
    telemetry.update()
    assert telemetry.first_fault is None


def test_each_asker_gets_each_sample_once(ring: Ring) -> None:
    telemetry, writer = Telemetry(ring), RingWriter(ring, 1)
    for tick in range(3):
        put(writer, tick)
    telemetry.update()
    cursor, columns = telemetry.columns(0)
    assert columns["tick"] == [0, 1, 2]
    put(writer, 3)
    telemetry.update()
    assert telemetry.columns(cursor)[1]["tick"] == [3]


# the picture


def status(**changed: Any) -> dict[str, Any]:
    loop = {
        "tick": 7, "missed": 2, "ring_fill": 0.01, "p1_cmd_mpa": 0.3, "p2_cmd_mpa": 0.1, "p1_mpa": 0.29, "p2_mpa": None,
        "angle_deg": 12.5,
        "lateness_us": {"p50": 20, "p99": 50, "max": 100, "edges_us": [10, 20], "histogram": [1, 100, 0]},
    }  # fmt: skip
    whole = {
        "rig": "simulated", "state": "running", "session": "ab", "uptime_s": 1.0, "fault": None, "pause_s": 0.0,
        "queue": [], "left_s": 5.0,
        "record": {"name": "sine", "done": 0.5, "left_s": 5.0}, "working": True, "loop": loop, "disk_free_gb": 3.0,
        "logs": "/logs",
        "processes": {"recorder": {"pid": 1, "alive": False}}, "realtime": {"fifo": "denied: no"},
    }  # fmt: skip
    return whole | changed


def empty() -> Window:
    return Window(0.005, PNEUMATIC)


def shown(status: dict[str, Any], window: Window, size: tuple[int, int] = (120, 40)) -> str:
    console = Console(width=size[0], record=True, file=open("/dev/null", "w"))  # noqa: SIM115
    console.print(picture(status, window, size, "note"))
    console.file.close()
    return console.export_text()


def test_the_picture_holds_what_an_operator_needs() -> None:
    fault = {"name": "BROKEN_WIRE", "cause": "a wire is broken", "hint": "check its wire", "said": "monitor 1"}
    text = shown(status(state="fault", fault=fault, black_boxes=["/old.mcap", "/new.mcap"]), empty())
    parts = (
        "FAULT",
        "BROKEN_WIRE: a wire is broken (monitor 1)",
        "what to do: check its wire",
        "black box: /new.mcap",
        "not running: recorder",
        "fifo denied: no",
    )
    parts += (
        "set-points 0.300 0.100",
        "measured 0.290 - MPa",
        "angle  +12.50",
        "missed 2",
        "3.0 GB free",
        "note",
        "emergency stop",
    )
    for part in parts:
        assert part in text


def swept() -> Window:
    window = empty()
    n = 100
    window.add(
        {
            "tick": list(range(n)),
            "p1_cmd_mpa": [0.2 + i / n / 10 for i in range(n)],
            "p2_cmd_mpa": [0.2] * n,
            "angle_deg": [float(i) for i in range(n)],
        }
    )
    return window


def test_a_job_that_failed_is_shown_until_another_is_over() -> None:
    job = {"id": 1, "name": "a", "state": "failed", "done": 0, "total": 1, "error": "a.yaml: no such file"}
    assert "job 1 a: failed, 0 of 1 records (a.yaml: no such file)" in shown(status(queue=[job]), empty())
    assert "failed" not in shown(status(queue=[job, job | {"state": "done", "error": ""}]), empty())


def test_a_finished_job_with_records_that_are_not_valid_says_so() -> None:
    job = {"id": 1, "name": "a", "state": "done", "done": 10, "total": 10, "not_valid": 2, "error": ""}
    assert "job 1 a: done, 10 of 10 records, 2 not valid" in shown(status(queue=[job]), empty())
    assert "job 1" not in shown(status(queue=[job | {"not_valid": 0}]), empty())


def test_the_picture_plots_what_came_in() -> None:
    text = shown(status(), swept())
    assert "angle in degrees over seconds" in text
    assert "angle in degrees over p1 - p2 in MPa" in text


@pytest.mark.parametrize("jobs", [0, 2, 12])
def test_the_picture_fits_a_small_terminal_and_keeps_its_keys(jobs: int) -> None:
    queue = [{"id": n, "name": "paper", "state": "waiting", "done": 0, "total": 15, "error": ""} for n in range(jobs)]
    lines = shown(status(queue=queue), swept(), (80, 24)).rstrip("\n").split("\n")
    assert "emergency stop" in lines[0]
    assert len(lines) <= 24
    assert ("angle in degrees over seconds" in "\n".join(lines)) == (jobs < 12)


def test_the_window_rolls_leaves_gaps_out_and_begins_anew_with_a_session() -> None:
    window = empty()
    ticks = list(range(round(WINDOW_S / 0.005) + 10))
    window.add(
        {
            "tick": ticks,
            "p1_cmd_mpa": [0.2] * len(ticks),
            "p2_cmd_mpa": [0.1] * len(ticks),
            "angle_deg": [None, *[1.0] * (len(ticks) - 1)],
        }
    )
    assert len(window.t_s) == WINDOW_S / 0.005
    window.add({"tick": [1], "p1_cmd_mpa": [0.2], "p2_cmd_mpa": [0.1], "angle_deg": [1.0]})
    assert list(window.t_s) == [0.005]


def test_a_rare_class_of_lateness_does_not_vanish_beside_a_frequent_one() -> None:
    bars = lateness_bars({"edges_us": [10, 20], "histogram": [1000, 1, 0]})
    assert "██▁▁" in bars
    assert lateness_bars({}) == ""


def test_keys_stop_and_stop_at_once_and_errors_are_shown() -> None:
    calls: list[str] = []

    class Daemon:
        def estop(self) -> dict[str, str]:
            calls.append("estop")
            return {"words": "safe state written by the loop"}

        def call(self, command: str, **_: Any) -> dict[str, str]:
            calls.append(command)
            raise RigError("nothing runs")

    daemon: Any = Daemon()
    assert act(daemon, "e") == act(daemon, " ") == "emergency stop: safe state written by the loop"
    assert act(daemon, "s") == "nothing runs"
    assert act(daemon, "x") == ""
    assert calls == ["estop", "estop", "stop"]


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
