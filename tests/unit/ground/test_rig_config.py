"""The YAML of a rig: roles, ranges and paths, each mistake in one line; the rigs that come with pamrig load."""

from pathlib import Path

import pytest

from rig.app import compose, shipped
from rig.errors import ConfigError
from rig.interfaces import Role
from rig.rig_config import apart, load_rig

GOOD = """\
name: mine
devices:
  main: {kind: simulated, model: m.yaml}
roles: {valve_1: main, valve_2: main, angle: main}
"""
EMPTY = "is empty; the first value must be the smaller one"


def no_line(key: str, text: str) -> str:
    return f"{key}: expected text of one line, got {text!r}; behind `>` or `|` a minus drops the line's end"


def load(folder: Path, text: str) -> str:
    path = folder / "rig.yaml"
    path.write_text(text)
    with pytest.raises(ConfigError) as error:
        load_rig(path)
    line = str(error.value)
    assert "\n" not in line
    return line.removeprefix(f"{path}: ")


def test_the_smallest_rig_has_the_defaults(tmp_path: Path) -> None:
    path = tmp_path / "rig.yaml"
    path.write_text(GOOD)
    rig = load_rig(path)
    assert (rig.name, rig.period_ns, rig.safe.p1_mpa, rig.limits.slew_mpa_s) == ("mine", 5_000_000, 0.2, 5.0)
    (device,) = rig.devices
    assert (device.kind, device.settings) == ("simulated", {"model": "m.yaml"})
    assert device.roles == {Role.VALVE_1, Role.VALVE_2, Role.ANGLE}
    assert rig.files == {"rig.yaml": GOOD.encode()}


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("name: mine", "nam: mine", "unknown key 'nam'; did you mean 'name'?"),
        ("name: mine", "name: mine\nperiod_s: 0.005", "unknown key 'period_s'; did you mean 'period_ms'?"),
        ("name: mine", "name: mine\nperiod_ms: 0.5", "period_ms: 0.5 ms is outside 1 .. 100 ms"),
        ("name: mine", "name: mine\nsafe: {p1_mpa: 0.7}", "safe.p1_mpa: 0.7 MPa is outside limits.pressure_mpa, 0 .. "
                                                          "0.5 MPa"),
        ("name: mine", "name: mine\nlimits: {pressure_mpa: [0.5, 0.0]}", f"limits.pressure_mpa: 0.5 .. 0 {EMPTY}"),
        ("name: mine", "name: mine\nlimits: {angle_deg: [9, 9]}", f"limits.angle_deg: 9 .. 9 {EMPTY}"),
        ("name: mine", "name: mine\nlimits: {slew_mpa: 3}",
        "limits: unknown key 'slew_mpa'; did you mean 'slew_mpa_s'?"),
        ("valve_1: main", "valve_1: man", "roles.valve_1: no device 'man'; did you mean 'main'?"),
        ("valve_1: main", "vlave_1: main", "roles: unknown role 'vlave_1'; did you mean 'valve_1'?"),
        ("angle: main", "monitor_1: main", "roles: angle is missing; a rig needs valve_1, valve_2 and angle"),
        ("  main:", "  spare: {kind: simulated}\n  main:", "devices.spare: no role names this device"),
        ("{kind: simulated, model: m.yaml}", "{model: m.yaml}", "devices.main: expected a mapping with the key kind"),
        ("name: mine", 'name: "mine\\nother.yaml: ok"', no_line("name", "mine\nother.yaml: ok")),
        ("name: mine", "name: >\n  mine", no_line("name", "mine\n")),
        ("name: mine", 'name: "\\e[2Jmine"', no_line("name", "\x1b[2Jmine")),
        ("  main:", '  "ma\\nin": {kind: simulated}\n  main:', no_line("devices", "ma\nin")),
        ("{kind: simulated, model: m.yaml}", "3", "devices.main: expected a mapping with the key kind"),
    ],
)  # fmt: skip
def test_mistakes_are_one_line(tmp_path: Path, old: str, new: str, line: str) -> None:
    assert load(tmp_path, GOOD.replace(old, new)) == line


def test_a_missing_calibration_is_told_by_its_key_and_where_it_was_looked_for(tmp_path: Path) -> None:
    said = load(tmp_path, GOOD + "calibration: calibration_of_may.yaml\n")
    place = tmp_path / "calibration_of_may.yaml"
    assert said == f"calibration: calibration_of_may.yaml: no such file; looked for at {place}"
    (tmp_path / "cal.yaml").write_text("- a\n")
    assert load(tmp_path, GOOD + "calibration: cal.yaml\n").endswith("expected a mapping of roles to calibrations")


def test_the_roof_checks_the_device_s_own_settings(tmp_path: Path) -> None:
    path = tmp_path / "rig.yaml"
    for text, expected in [
        (GOOD.replace("model:", "modle:"), f"{path}: devices.main: unknown key 'modle'; did you mean 'model'?"),
        (
            GOOD.replace("simulated", "simulatd"),
            f"{path}: devices.main: unknown kind of device 'simulatd'; did you mean 'simulated'?",
        ),
        (GOOD.replace("m.yaml", "m.yaml, angle_bits: 99"), f"{path}: devices.main: angle_bits: 99 is outside 8 .. 24"),
    ]:
        path.write_text(text)
        with pytest.raises(ConfigError) as error:
            compose.load(path)
        assert str(error.value) == expected


def test_the_roof_knows_the_effects_that_a_rig_may_have(tmp_path: Path) -> None:
    path, model = tmp_path / "rig.yaml", shipped.configs() / "models" / "simulated.yaml"
    path.write_text(GOOD.replace("m.yaml", f"{model}") + "effects: [joint, valve_lagg]\n")
    with pytest.raises(ConfigError, match=r"rig\.yaml: effects: unknown effect or stage 'valve_lagg'; did you mean"):
        compose.load(path)
    path.write_text(path.read_text().replace("valve_lagg", "valve_lag"))
    assert compose.load(path).effects == ("joint", "valve_lag")


@pytest.mark.parametrize("path", sorted((shipped.configs() / "rigs").glob("*.yaml")), ids=lambda path: path.stem)
def test_the_rigs_that_come_with_pamrig_load(path: Path) -> None:
    rig = compose.load(path)
    assert set().union(*(device.roles for device in rig.devices)) >= {Role.VALVE_1, Role.VALVE_2, Role.ANGLE}


@pytest.mark.parametrize("path", sorted((shipped.configs() / "rigs").glob("*.yaml")), ids=lambda path: path.stem)
def test_where_nothing_moves_without_the_loop_a_machine_may_stand_still_for_as_long(path: Path) -> None:
    """Tutorials and hunts run on these, on machines that do other things as well."""
    rig, usual = compose.load(path), compose.load(None)
    if all(device.kind in ("simulated", "physics") for device in rig.devices):
        assert rig.limits.stall_periods == usual.limits.stall_periods == 40
        assert rig.limits.misses_per_s == usual.limits.misses_per_s == 20


def test_a_kind_that_nobody_knows_is_refused_with_how_one_s_own_is_made_known(tmp_path: Path) -> None:
    path = tmp_path / "rig.yaml"
    path.write_text(GOOD.replace("kind: simulated", "kind: my_own_adc"))
    with pytest.raises(ConfigError, match=r"allowed: emulated, .* a device of your own is an entry point `pamrig.dev"):
        compose.load(path)


def test_the_log_gets_the_rig_and_its_model() -> None:
    rig = compose.load(None)
    assert set(rig.files) == {"rig.yaml", "simulated.yaml"}
    assert rig.files["simulated.yaml"] == (shipped.configs() / "models" / "simulated.yaml").read_bytes()


def written(folder: Path, model: Path | str) -> Path:
    """A rig of a folder, whose model is that file."""
    path = folder / "rig.yaml"
    path.write_text(GOOD.replace("m.yaml", f"{model}"))
    return path


def test_a_log_gets_the_rig_that_was_read_and_not_the_one_that_is_there_now(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Rig and calibration were read once to go by, and once more for the log."""
    path = written(tmp_path, shipped.configs() / "models" / "simulated.yaml")
    (tmp_path / "cal.yaml").write_text("angle: {knots: [[0.0, -170.0], [1.0, 170.0]]}\n")
    path.write_text(path.read_text() + "calibration: cal.yaml\n")
    was = {one: one.read_bytes() for one in (path, tmp_path / "cal.yaml")}
    read = Path.read_bytes

    def changed_afterwards(self: Path) -> bytes:
        found = read(self)
        if self in was:
            self.write_bytes(found + b"# by another hand\n")
        return found

    monkeypatch.setattr(Path, "read_bytes", changed_afterwards)
    rig = compose.load(path)
    assert (rig.files["rig.yaml"], rig.files["cal.yaml"]) == tuple(was.values())


def test_a_model_that_is_written_to_meanwhile_is_said(tmp_path: Path) -> None:
    """The session would follow the new one, and its records hold the old one."""
    model = tmp_path / "model.yaml"
    model.write_bytes((shipped.configs() / "models" / "simulated.yaml").read_bytes())
    rig = compose.load(written(tmp_path, "model.yaml"))
    compose.check_as_loaded(rig)
    model.write_text(model.read_text() + "# tuned\n")
    with pytest.raises(ConfigError, match=r"model\.yaml: was written to since the rig was loaded: start anew"):
        compose.check_as_loaded(rig)
    model.unlink()
    compose.check_as_loaded(rig)  # what is gone is told by the device


def test_two_files_of_one_name_are_both_in_the_log(tmp_path: Path) -> None:
    """A calibration that is called rig.yaml, in a folder of its own, took the place of the rig."""
    model = shipped.configs() / "models" / "simulated.yaml"
    for folder in ("lab", "lab/of_monday"):
        (tmp_path / folder).mkdir()
    path = written(tmp_path / "lab", model)
    (tmp_path / "lab" / "of_monday" / "rig.yaml").write_text("angle: {knots: [[0.0, -170.0], [1.0, 170.0]]}\n")
    path.write_text(path.read_text() + "calibration: of_monday/rig.yaml\n")
    files = compose.load(path).files
    assert sorted(files) == ["rig.yaml", "rig_2.yaml", "simulated.yaml"]
    assert files["rig.yaml"] == path.read_bytes()
    assert files["rig_2.yaml"].startswith(b"angle:")
    assert apart({"a.yaml": b"1"}, {"a.yaml": b"2", "b": b""}, {"a.yaml": b"2"}, {"a.yaml": b"3", "b": b"x"}) == {
        "a.yaml": b"1", "a_2.yaml": b"2", "b": b"", "a_3.yaml": b"3", "b_2": b"x",
    }  # fmt: skip


def test_own_configs_are_found_by_name_and_strangers_by_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    own = shipped.configs() / "sweeps" / "quick.yaml"
    for name in ("quick", "quick.yaml", "configs/sweeps/quick.yaml"):
        assert shipped.find_config(Path(name), "sweeps") == own
    (tmp_path / "quick").write_text("")
    assert shipped.find_config(Path("quick"), "sweeps") == Path("quick"), "a file of the user comes first"
    assert shipped.find_config(Path("/elsewhere/quick"), "sweeps") == Path("/elsewhere/quick")
    with pytest.raises(ConfigError, match="quik: no such file, nor one of pamrig's own sweeps; did you mean 'quick'"):
        shipped.find_config(Path("quik"), "sweeps")


def test_a_folder_of_records_does_not_hide_an_own_config(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """After `pamrig run quick -o quick` the sweep was "a folder, and a file is meant"."""
    monkeypatch.chdir(tmp_path)
    for folder in ("quick", "mine"):
        (tmp_path / folder).mkdir()
    assert shipped.find_config(Path("quick"), "sweeps") == shipped.configs() / "sweeps" / "quick.yaml"
    assert shipped.find_config(Path("mine"), "sweeps") == Path("mine"), "whoever reads it says that it is a folder"


def test_an_emulated_rig_names_every_file_that_it_stands_on() -> None:
    files = compose.load(shipped.configs() / "rigs" / "emulated_all_modbus.yaml").files
    assert sorted(files) == ["all_modbus.yaml", "rig.yaml", "simulated.yaml", "wago_750.yaml"]
    assert b"emulated" in files["rig.yaml"]


@pytest.mark.parametrize(
    ("changes", "valve", "span"),
    [
        ({"high_mpa: 0.5": "high_mpa: 0.4"}, "valve_1", "0 .. 0.4"),
        ({"pressure_mpa: [0.005, 0.5]": "pressure_mpa: [0.005, 0.9]"}, "valve_1", "0 .. 0.5"),
        (
            {"pressure_mpa: [0.005, 0.5]": "pressure_mpa: [0.0, 0.5]", "low_mpa: 0.0": "low_mpa: 0.005"},
            "valve_1",
            "0.005",
        ),
    ],
)
def test_limits_beyond_what_a_valve_can_be_given_are_refused(
    tmp_path: Path, changes: dict[str, str], valve: str, span: str
) -> None:
    """The driver would clamp, safe set-points too, and the log would say what never stood at the valve."""
    rigs = shipped.configs() / "rigs"
    text = (rigs / "all_modbus.yaml").read_text(encoding="utf-8").replace("../modbus", str(rigs.parent / "modbus"))
    path = tmp_path / "rig.yaml"
    path.write_text(text)
    compose.load(path)
    for before, after in changes.items():
        assert before in text
        text = text.replace(before, after, 1)
    path.write_text(text)
    with pytest.raises(ConfigError, match=f"limits.pressure_mpa, .* goes beyond what {valve} .* {span}"):
        compose.load(path)
