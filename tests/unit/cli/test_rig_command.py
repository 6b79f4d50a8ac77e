"""`pamrig rig new` and `rig check`, and completion in the shell: real processes, as a user calls them."""

import json
import os
import re
import subprocess
from pathlib import Path

import click
import pytest
from click.testing import CliRunner
from support.run_command import PAMRIG

from rig.app.compose import load
from rig.app.devices.new_rig import PATTERNS
from rig.cli.commands import COMMANDS, cli
from rig.cli.completion import OURS, SUFFIXES, WRITTEN, with_files
from rig.errors import ConfigError
from rig.outputs import OutputKind


def called(*words: object) -> dict[str, object]:
    result = CliRunner().invoke(cli, [*map(str, words), "--json", "-"], catch_exceptions=False)
    assert result.exit_code == 0
    found: dict[str, object] = json.loads(result.stdout[result.stdout.index("{\n") :])
    return found


@pytest.mark.parametrize("pattern", PATTERNS)
def test_every_pattern_becomes_a_rig_that_the_check_passes(tmp_path: Path, pattern: str) -> None:
    made = tmp_path / "sub" / "mine.yaml"
    called("rig", "new", "--like", pattern, "--yes", "--set", "period of the loop=10", "-o", made)
    assert called("rig", "check", made)["ok"] is True
    assert load(made).name == "mine"
    assert load(made).period_ns == 10_000_000
    text = made.read_text()
    assert not re.search(r"\.\./\S*(models|rigs|modbus)/", text)  # pamrig's own files by name: they move with updates


def test_questions_are_answered_on_the_terminal(tmp_path: Path) -> None:
    made = tmp_path / "mine.yaml"
    answers = ["simulated", "bench 3", "", "0.01", "0.4", "0.15", "0.15", "-45", "45"]
    done = CliRunner().invoke(cli, ["rig", "new", "-o", str(made)], input="\n".join(answers) + "\n" * 20)
    assert done.exit_code == 0, done.output
    rig = load(made)
    assert rig.name == "bench 3"
    assert rig.limits.pressure_mpa == (0.01, 0.4)
    assert (rig.safe.p1_mpa, rig.limits.angle_deg) == (0.15, (-45.0, 45.0))


def test_a_rig_that_is_there_is_not_written_over_and_nothing_is_asked(tmp_path: Path) -> None:
    made = tmp_path / "mine.yaml"
    called("rig", "new", "--like", "simulated", "--yes", "-o", made)
    edited = made.read_text() + "# the left regulator sticks below 0.02 MPa\n"
    made.write_text(edited)
    for asking in ((), ("--yes",)):
        done = CliRunner().invoke(cli, ["rig", "new", *asking, "-o", str(made)])
        assert f"{made}: exists already; name another file" in str(done.exception)
        assert done.output == ""
    assert made.read_text() == edited


def test_an_answer_to_nothing_is_said_before_anything_is_asked(tmp_path: Path) -> None:
    call = ["rig", "new", "--like", "simulated", "--set", "nonsense=1", "-o", str(tmp_path / "mine.yaml")]
    done = CliRunner().invoke(cli, call)
    assert isinstance(done.exception, ConfigError)
    assert done.output == ""


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--set", "safe pressure of muscle 1=0.9"], "safe.p1_mpa: 0.9 MPa is outside"),
        (["--set", "period of the loop=soon"], "expected a number"),
        (
            ["--set", "nonsense=1"],
            "--set nonsense: nothing is asked by that name; allowed: highest angle, highest press",
        ),
        (["--set", "period of the lop=5"], "did you mean 'period of the loop'"),
        (["--set", "name"], "--set name: expected QUESTION=ANSWER, for example --set name=mine"),
        (["--set", "name= "], "expected QUESTION=ANSWER"),
        (["--like", "simulatd"], "did you mean 'simulated'"),
    ],
)
def test_an_answer_that_makes_no_rig_writes_nothing(tmp_path: Path, words: list[str], said: str) -> None:
    made = tmp_path / "mine.yaml"
    with pytest.raises(ConfigError, match=said):
        cli.main(["rig", "new", "--yes", *words, "-o", str(made)], standalone_mode=False)
    assert list(tmp_path.iterdir()) == []


MODBUS = """
name: mine
devices:
  io:
    kind: modbus_io
    map: wago_750
    host: 192.168.1.17
    valve_1: {channel: 0, signal: 0-10 V}
    valve_2: {channel: 1, signal: 0-10 V}
    monitor_1: {channel: 0, signal: 1-5 V}
    monitor_2: {channel: 1, signal: 1-5 V}
    angle: {wiper: 2, reference_v: 5.0}
roles: {valve_1: io, valve_2: io, monitor_1: io, monitor_2: io, angle: io}
"""
MYRIO = """
name: mine
devices:
  io:
    kind: myrio
    bitfile: mine.lvbitx
    valve_1: {register: AO.A_0.VAL, signal: 0-5 V}
    valve_2: {register: AO.A_1.VAL, signal: 0-5 V}
roles: {valve_1: io, valve_2: io, monitor_1: io, monitor_2: io, angle: io}
"""
SERIAL = """
name: mine
devices:
  valves: {kind: itv_serial, valve_1: {device: /dev/a}, valve_2: {device: /dev/b}}
  io: {kind: modbus_io, map: moxa_e1240, host: 192.168.1.18, angle: {wiper: 0, excitation: 1}}
roles: {valve_1: valves, valve_2: valves, monitor_1: valves, monitor_2: valves, angle: io}
"""

APART = """
name: mine
devices:
  one: {kind: modbus_io, map: wago_750, host: wago.lab, unit: 1, valve_1: {channel: 0}, monitor_1: {channel: 0}}
  two: {kind: modbus_io, map: wago_750, host: wago.lab, unit: 2, valve_2: {channel: 1}, monitor_2: {channel: 1}}
  pot: {kind: modbus_io, map: moxa_e1240, host: 192.168.1.18, angle: {wiper: 0, excitation: 1}}
roles: {valve_1: one, valve_2: two, monitor_1: one, monitor_2: two, angle: pot}
"""
TWO_PORTS = """
name: mine
devices:
  one: {kind: itv_serial, valve_1: {device: /dev/a}}
  two: {kind: itv_serial, valve_2: {device: /dev/b}}
  io: {kind: modbus_io, map: moxa_e1240, host: 192.168.1.18, angle: {wiper: 0, excitation: 1}}
roles: {valve_1: one, valve_2: two, monitor_1: one, monitor_2: two, angle: io}
"""
TWO_MYRIOS = """
name: mine
devices:
  one: {kind: myrio, bitfile: mine.lvbitx, resource: RIO0}
  two: {kind: myrio, bitfile: mine.lvbitx, resource: RIO0}
roles: {valve_1: one, valve_2: two, monitor_1: one, monitor_2: two, angle: two}
"""


@pytest.mark.parametrize(
    ("text", "old", "new", "said"),
    [
        (
            APART,
            "valve_2: {channel: 1",
            "valve_2: {channel: 0",
            r"devices.one: valve_1 and devices.two: valve_2 are both on wago.lab:502 \(no gateway\), output channel 0: "
            "each needs its own",
        ),
        (APART, "unit: 2, valve_2: {channel: 1", "unit: 1, valve_2: {channel: 0", "are both on wago.lab:502"),
        (
            APART.replace("unit:", "gateway: true, unit:").replace("channel: 1", "channel: 0"),
            "unit: 2",
            "unit: 1",
            "both on wago.lab:502 unit 1, input channel 0",
        ),
        (APART, "monitor_2: {channel: 1", "monitor_2: {channel: 0", "monitor_1 and .* monitor_2 .* input channel 0"),
        (
            APART,
            "192.168.1.18, angle: {wiper: 0",
            "Wago.lab, angle: {wiper: 1, reference_v: 5.0}}\n#",
            "monitor_2 and devices.pot: angle are both on wago.lab:502 .*, input channel 1",
        ),
        (TWO_PORTS, "/dev/b", "/dev/a", "devices.one: .* and devices.two: .* are both on /dev/a: each needs its own"),
        (
            TWO_MYRIOS,
            "resource: RIO0}\nroles",
            "resource: RIO0, valve_2: {register: AO.A_0.VAL, signal: 0-5 V}}\nroles",
            "devices.one: valve_1 and devices.two: valve_2 are both on RIO0 AO.A_0.VAL",
        ),
        (MODBUS, "valve_2: {channel: 1", "valve_2: {channel: 0", "devices.io: both valves on output channel 0"),
        (MODBUS, "valve_2: {channel: 1", "valve_2: {channel: 4", "does not exist; allowed: 0 .. 3"),
        (MODBUS, "wiper: 2", "wiper: 1", "devices.io: monitor_2 and angle.wiper are both on input channel 1"),
        (MODBUS, "1.17", "1.17:502", "devices.io: host: '192.168.1.17:502': the port has a key of its own, port"),
        (MODBUS, "192.168.1.17", "192.168.1", "devices.io: host: '192.168.1' is no address; expected four numbers"),
        (MODBUS, "wago_750", "wago_75", "devices.io.map: wago_75: no such file; .*; did you mean 'wago_750'"),
        (MODBUS, "reference_v: 5.0", "reference_v: 5,0", "angle: a number, 0, stands where a key should; decimals"),
        (MODBUS, "  io:", "\tio:", r"line 4: not valid YAML: a tab; indent by spaces"),
        (MODBUS, "    host", "      host", "line 7: not valid YAML: a colon where none can stand"),
        (MODBUS, "    host", "   host", "line 7: not valid YAML: it is indented otherwise than the lines before it"),
        (MODBUS, "  io:\n    kind", "  - io:\n    kind", "devices: expected a mapping, got a list"),
        (MODBUS, "roles:", "safe: {p1_mpa: 200}\nroles:", "200 MPa is outside 0 .. 1 MPa; 200 kPa are 0.2 MPa"),
        (MYRIO, "AO.A_1", "AO.A_0", "devices.io: valve_1 and valve_2 are both on AO.A_0.VAL: each needs its own"),
        (MYRIO, "AO.A_1", "AI.A_1", "devices.io: valve_2.register: 'AI.A_1.VAL' is not an analog output"),
        (MYRIO, "mine.lvbitx", "mine.lvbitx\n    resource: 172.22.11.2", "resource: expected RIO0 or rio://HOST/RIO0"),
        (SERIAL, "/dev/b", "/dev/a", "devices.valves: both valves on /dev/a"),
        (SERIAL, "device: /dev/a", "port: /dev/a", "unknown key 'port'; allowed: baud, data_bits, device"),
        (SERIAL, "moxa_e1240", "moxa_e1241", "devices.io: angle.wiper: Moxa ioLogik E1241 has no inputs"),
    ],
)
def test_what_people_mistake_is_one_line_of_the_check(tmp_path: Path, text: str, old: str, new: str, said: str) -> None:
    assert old in text
    place = tmp_path / "mine.yaml"
    place.write_text(text)
    assert called("rig", "check", place)["ok"] is True
    place.write_text(text.replace(old, new))
    with pytest.raises(ConfigError, match=said) as caught:
        cli.main(["rig", "check", str(place)], standalone_mode=False)
    assert str(caught.value).startswith(str(place))


def test_a_bitfile_that_is_not_there_yet_is_a_warning(tmp_path: Path) -> None:
    place = tmp_path / "mine.yaml"
    place.write_text(MYRIO)
    said = f"devices.io.bitfile: mine.lvbitx: no such file yet; looked for at {tmp_path / 'mine.lvbitx'}"
    assert said in str(called("rig", "check", place)["warnings"])


def completed(line: str, folder: Path) -> set[str]:
    words = line.split(" ")
    asked = {"COMP_WORDS": line, "COMP_CWORD": str(len(words) - 1), "_PAMRIG_COMPLETE": "bash_complete"}
    done = subprocess.run([PAMRIG], env=os.environ | asked, cwd=folder, capture_output=True, text=True, check=True)
    return {one.partition(",")[2] for one in done.stdout.splitlines()}


def test_files_are_completed_by_what_an_argument_takes(tmp_path: Path) -> None:
    for name in ("a.mcap", "a.csv.gz", "a.yaml", "a.txt", ".hidden.mcap"):
        (tmp_path / name).write_bytes(b"")
    (tmp_path / "apart").mkdir()
    assert completed("pamrig log info a", tmp_path) == {"a.mcap", "a.csv.gz", "apart/"}
    assert completed("pamrig identify a.mcap -o a", tmp_path) == {"a.yaml", "apart/"}
    assert completed("pamrig run pa", tmp_path) == {"paper", "paper_fig1"}
    assert completed("pamrig rig ch", tmp_path) == {"check"}
    assert "--mapping" in completed("pamrig log import --", tmp_path)


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_each_shell_gets_its_script(shell: str) -> None:
    done = CliRunner().invoke(cli, ["completion", shell])
    assert done.exit_code == 0
    assert "_PAMRIG_COMPLETE" in done.output


def every_command(command: click.Command) -> list[click.Command]:
    below = command.commands.values() if isinstance(command, click.Group) else ()
    return [command, *(found for one in below for found in every_command(one))]


def test_every_parameter_that_takes_a_file_says_which() -> None:
    assert set(WRITTEN) == set(OutputKind)
    assert set(OURS) <= set(SUFFIXES)
    context = click.Context(cli)
    read = {
        param.name
        for name in COMMANDS
        for one in every_command(with_files(cli.get_command(context, name) or cli))
        for param in one.params
        if isinstance(param.type, click.Path) and param.type.file_okay
    }
    assert read <= set(SUFFIXES)
