"""A mapping guessed for a table that nobody described: names, units, signs, time in ms; and what it does not guess."""

import csv
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
import yaml
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st

from rig.app.records.logs import import_content, proposed_mapping
from rig.errors import RecordError
from rig.log.convert import write_content
from rig.log.foreign.guess import guess
from rig.log.log_files import stem
from rig.log.reader import read
from rig.record import Record

T = np.arange(0, 400)
SINE = np.sin(2 * np.pi * 0.5 * 0.005 * T)


def table(
    folder: Path, head: str, *columns: np.ndarray, separator: str = ",", decimal: str = ".", before: str = ""
) -> Path:
    rows = [
        separator.join(f"{value:.12g}" for value in row).replace(".", decimal) for row in zip(*columns, strict=True)
    ]
    path = folder / "unknown.csv"
    path.write_text(before + head + "\n" + "\n".join(rows) + "\n", encoding="utf-8")
    return path


def test_a_german_table_with_decimal_commas_and_time_in_ms(tmp_path: Path) -> None:
    path = table(
        tmp_path, "Zeit;Soll (bar);Druck 1 (bar);Druck 2 (bar);Winkel (rad);Temperatur", 5.0 * T, 2 * SINE, 2 + SINE,
        2 - SINE, 0.35 * SINE, 20 + 0.001 * T, separator=";", decimal=",", before="Rig 2\nvon Hand\n",
    )  # fmt: skip
    found = guess(path)
    assert (found.mapping["separator"], found.mapping["decimal"], found.mapping["skip_rows"]) == (";", ",", 2)
    assert found.mapping["columns"] == {
        "t_s": {"source": "Zeit", "unit": "ms"},
        "dp_cmd_mpa": {"source": "Soll (bar)", "unit": "bar"},
        "p1_mpa": {"source": "Druck 1 (bar)", "unit": "bar"},
        "p2_mpa": {"source": "Druck 2 (bar)", "unit": "bar"},
        "angle_deg": {"source": "Winkel (rad)", "unit": "rad"},
    }
    assert list(found.mapping["further"]) == ["temperatur"]
    assert any("every 5 ms" in line for line in found.meaning)


@pytest.mark.parametrize(
    ("set_point", "measured"),
    [
        ("pset{}_psi", "p{}_psi"),
        ("PSP{}_psi", "PPV{}_psi"),
        ("Solldruck_{}_psi", "Istdruck_{}_psi"),
        ("SP{}_psi", "PV{}_psi"),
    ],
)
def test_words_that_are_written_together_are_read(tmp_path: Path, set_point: str, measured: str) -> None:
    names = [set_point.format(1), set_point.format(2), measured.format(1), measured.format(2)]
    up, down = 29 + 14 * SINE, 29 - 14 * SINE
    path = table(tmp_path, f"t,{','.join(names)},theta_deg", 0.005 * T, up, down, 0.99 * up, 0.99 * down, 20 * SINE)
    found = guess(path)
    wanted = dict(zip(("p1_cmd_mpa", "p2_cmd_mpa", "p1_mpa", "p2_mpa"), names, strict=True))
    assert {name: found.mapping["columns"][name]["source"] for name in wanted} == wanted
    assert "further" not in found.mapping


def test_units_by_size_and_swapped_sides_are_said(tmp_path: Path) -> None:
    path = table(tmp_path, "time,cmd,p1,p2,angle", 0.005 * T, 200 * SINE, 200 - 99 * SINE, 200 + 99 * SINE, -20 * SINE)
    found = guess(path)
    columns = found.mapping["columns"]
    assert columns["dp_cmd_mpa"]["unit"] == columns["p1_mpa"]["unit"] == "kPa"
    assert columns["angle_deg"]["unit"] == "deg"
    assert (columns["p1_mpa"]["source"], columns["p2_mpa"]["source"]) == ("p2", "p1")
    assert any("runs against the command" in line for line in found.doubts)
    assert any("scale: -1" in line for line in found.doubts)


def test_the_proposal_imports_the_file_that_it_was_made_for(tmp_path: Path) -> None:
    path = table(tmp_path, "t_ms,goal_mm,position_mm,load_N", 7.3 * T, 40 * SINE, 39 * SINE + 0.2, 5 + 0.1 * SINE)
    found, text = proposed_mapping(path)
    mapping = tmp_path / "mapping.yaml"
    mapping.write_text(text, encoding="utf-8")
    assert yaml.safe_load(text) == found.mapping
    content, unkept = import_content(path, mapping)
    assert unkept == []
    (record,) = read(write_content(content, tmp_path / "made.mcap"))
    assert record.channels.input.unit == "mm"
    assert record.period_s == pytest.approx(0.0073)
    assert record.extra["load_n"][0] == pytest.approx(5.0)
    assert record.angle_deg is not None
    assert record.channels.own_output(record.angle_deg)[0] == pytest.approx(0.2)


def test_what_stands_still_is_kept_as_it_may_be_a_condition(tmp_path: Path) -> None:
    path = table(tmp_path, "Zeit_ms,Istwert mm,Sollwert mm,Kraft_N", 7.3 * T, 38 * SINE, 40 * SINE, 20 + 0 * T)
    found = guess(path)
    assert found.mapping["columns"]["input"] == {"source": "Sollwert mm", "unit": "mm"}
    assert found.mapping["further"] == {"kraft_n": {"source": "Kraft_N", "unit": "N"}}
    assert found.doubts == [
        "the ranges are those of this record; state what the rig moves in, the same for all its records"
    ]


def test_a_tdms_by_its_own_units(tmp_path: Path) -> None:
    nptdms = pytest.importorskip("nptdms")
    path = tmp_path / "unknown.tdms"
    with nptdms.TdmsWriter(path) as writer:
        for name, values, unit in (("zeit", 5.0 * T, "ms"), ("soll", SINE, "bar"), ("winkel", 20 * SINE, "deg")):
            writer.write_segment([nptdms.ChannelObject("g", name, values, properties={"unit_string": unit})])
    columns = guess(path).mapping["columns"]
    assert columns["t_s"] == {"source": "g/zeit", "unit": "ms"}
    assert columns["dp_cmd_mpa"]["unit"] == "bar"


@pytest.mark.parametrize(
    ("name", "values", "side"),
    [
        ("p1_set", 0.2 + 0.1 * SINE, 1),
        ("soll_p2 (MPa)", 0.2 - 0.1 * SINE, 2),
        ("cmd", 0.2 + 0.1 * SINE, 1),
        ("cmd", 0.2 - 0.1 * SINE, 2),
        ("cmd", 0.2 * SINE, 0),
        ("dp_set", 0.1 + 0.2 * np.abs(SINE), 0),
        ("cmd", 0.2 * SINE + 0.25, 0),
    ],
)
def test_the_set_point_of_one_muscle_is_not_the_difference(
    tmp_path: Path, name: str, values: np.ndarray, side: int
) -> None:
    lift = 0.125 if name == "cmd" and values.mean() > 0.22 else 0.0
    p1, p2 = 0.2 + 0.1 * SINE + lift, 0.2 - 0.1 * SINE - lift
    found = guess(table(tmp_path, f"time,{name},ist_p1,ist_p2,angle", 0.005 * T, values, p1, p2, 20 * SINE))
    wanted = {f"p{side}_cmd_mpa": 1.0, f"p{3 - side}_cmd_mpa": -1.0} if side else {"dp_cmd_mpa": 1.0}
    columns = found.mapping["columns"]
    assert {key: entry.get("scale", 1.0) for key, entry in columns.items() if "cmd" in key} == wanted
    assert any("there is none of the other" in line for line in found.doubts) == bool(side)
    if side:
        assert columns[f"p{3 - side}_cmd_mpa"]["offset"] == pytest.approx(0.4 + 0 * lift)


def imported(path: Path) -> Record:
    """The table by its own proposal."""
    mapping = path.with_name("mapping.yaml")
    mapping.write_text(proposed_mapping(path)[1], encoding="utf-8")
    (record,) = read(write_content(import_content(path, mapping)[0], path.with_name("made.mcap")))
    return record


def test_a_muscle_alone_is_imported_about_p0_or_with_the_other_at_rest(tmp_path: Path) -> None:
    """Nothing was imported by such a proposal: the other muscle's set-point was left to whoever read it."""
    (tmp_path / "alone").mkdir()
    alone = table(tmp_path / "alone", "time,p1_set,angle", 0.005 * T, 0.2 + 0.1 * SINE, 20 * SINE)
    assert imported(alone).dp_cmd_mpa == pytest.approx(0.2 * SINE, abs=1e-5)
    still = 0.15 + 0.001 * np.cos(T)
    columns = (2 + SINE, 0.2 + 0.1 * SINE, still, 20 * SINE)
    beside = table(tmp_path, "time,p1_set (bar),ist_p1,ist_p2,angle", 0.005 * T, *columns)
    record = imported(beside)
    assert record.p2_cmd_mpa == pytest.approx(np.full(len(T), 0.15), abs=1e-3)
    assert record.p1_cmd_mpa == pytest.approx(0.2 + 0.1 * SINE, abs=1e-5)


def test_names_that_nothing_can_be_called_by_are_replaced(tmp_path: Path) -> None:
    """Such further channels, and such a channel map, were proposed and then refused."""
    long = "a very long name of a channel that goes on and on"
    head = f"time,cmd,angle,tick,2nd load,t_s_,{long}"
    path = table(tmp_path, head, 0.005 * T, 0.1 * SINE, 20 * SINE, SINE, 2 * SINE, 3 * SINE, 4 * SINE)
    assert set(imported(path).extra) >= {"tick_2", "column_2nd_load", "t_s_2", "a_very_long_name_of_a_channel_that_go"}
    (tmp_path / "servo").mkdir()
    servo = table(tmp_path / "servo", f"time,{long} goal V,{long} V,x_mpa", 0.005 * T, SINE, SINE + 1e9, SINE)
    assert imported(servo).channels.output.range[0] == pytest.approx(1e9 - 1.0)


def test_a_unit_that_is_no_angle_s_makes_no_angle(tmp_path: Path) -> None:
    path = table(tmp_path, "time,cmd_V,pot_V", 0.005 * T, SINE, 2.5 + SINE)
    assert imported(path).channels.output.unit == "V"


@pytest.mark.parametrize(("stated", "kept"), [("Bar", "MPa"), ("Degrees C", "own")])
def test_what_a_tdms_states_is_kept_to(tmp_path: Path, stated: str, kept: str) -> None:
    """A unit that the file states in another spelling is that unit; one that is none of ours stays what it is."""
    nptdms = pytest.importorskip("nptdms")
    path = tmp_path / "unknown.tdms"
    with nptdms.TdmsWriter(path) as writer:
        for name, values, unit in (("zeit", 5.0 * T, "ms"), ("soll", SINE, stated), ("winkel", 20 * SINE, "Deg")):
            writer.write_segment([nptdms.ChannelObject("g", name, values, properties={"unit_string": unit})])
    record = imported(path)
    if kept == "MPa":
        assert record.dp_cmd_mpa == pytest.approx(0.1 * SINE)
    else:
        assert record.channels.input.unit == stated


def test_what_no_mapping_can_import_is_not_proposed(tmp_path: Path) -> None:
    holed = np.where(T == 7, np.nan, SINE)
    path = table(tmp_path, "time,cmd,angle", 0.005 * T, holed, 20 * SINE)
    with pytest.raises(RecordError, match=r"dp_cmd_mpa is nan at row 8 of the data; it must be a number"):
        proposed_mapping(path)


NAMES = st.text("abdpt_ /%12.,;äµ°()", min_size=1, max_size=50) | st.sampled_from(
    ["t", "cmd", "p1", "p2", "angle", "winkel [V]", "tick", "phase", "_x", "time (ms)", "soll bar", "flags", "units"]
)


@given(
    names=st.lists(NAMES, min_size=3, max_size=9, unique_by=lambda name: name.strip()),
    sizes=st.lists(st.sampled_from([0.0, 1e-9, 0.1, 30.0, 1e7]), min_size=9, max_size=9),
    middles=st.lists(st.sampled_from([0.0, 0.2, -5.0, 1e9]), min_size=9, max_size=9),
)
@settings(max_examples=150, deadline=None)
def test_whatever_is_proposed_imports(names: list[str], sizes: list[float], middles: list[float]) -> None:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "odd.csv"
        columns = [
            middle + size * np.sin(0.1 * k * T[:60])
            for k, (size, middle) in enumerate(zip(sizes, middles, strict=True))
        ]
        rows = np.column_stack([0.005 * T[:60], *columns])[:, : len(names)]
        with path.open("w", encoding="utf-8", newline="") as file:
            writer = csv.writer(file)
            writer.writerow(names)
            writer.writerows(rows.tolist())
        try:
            guess(path)
        except RecordError:
            return
        assert len(imported(path)) == len(rows)


def test_a_second_muscle_that_stands_still_has_its_set_point(tmp_path: Path) -> None:
    path = table(tmp_path, "time,p1_set,p2_set,angle", 0.005 * T, 0.2 + 0.1 * SINE, 0.2 + 0 * T, 20 * SINE)
    columns = guess(path).mapping["columns"]
    assert (columns["p1_cmd_mpa"]["source"], columns["p2_cmd_mpa"]["source"]) == ("p1_set", "p2_set")
    assert "dp_cmd_mpa" not in columns


def test_without_set_points_both_measured_pressures_stand_for_them(tmp_path: Path) -> None:
    path = table(tmp_path, "time,p1,p2,angle", 0.005 * T, 0.2 + 0.1 * SINE, 0.2 - 0.1 * SINE, 20 * SINE)
    found = guess(path)
    assert {name: one["source"] for name, one in found.mapping["columns"].items() if "cmd" in name} == {
        "p1_cmd_mpa": "p1",
        "p2_cmd_mpa": "p2",
    }
    assert any("no set-point was found; 'p1' and 'p2'" in line for line in found.doubts)


def _lvm(tail: str) -> str:
    """A file as LabVIEW's Write To Measurement File makes it: two heads, then the table; `tail` ends each row."""
    head = (
        "LabVIEW Measurement\t\nSeparator\tTab\nDecimal_Separator\t.\nX_Columns\tOne\nDate\t2026/03/01\n"
        "Time\t10:00:00\n"
        "***End_of_Header***\t\n\t\nChannels\t3\t\t\nSamples\t400\t400\t400\nDate\t2026/03/01\t2026/03/01\t2026/03/01\n"
        "X_Dimension\tTime\tTime\tTime\nX0\t0\t0\t0\nDelta_X\t0.005\t0.005\t0.005\n***End_of_Header***\t\t\t\n"
    )
    rows = (
        f"{0.005 * k:.6f}\t{0.2 + 0.1 * SINE[k]:.6f}\t{0.2 - 0.1 * SINE[k]:.6f}\t{20 * SINE[k]:.6f}{tail}" for k in T
    )
    return head + "X_Value\tp1 set (MPa)\tp2 set (MPa)\tangle (deg)\tComment\n" + "\n".join(rows) + "\n"


@pytest.mark.parametrize("tail", ["", "\t"])
def test_a_measurement_file_of_labview(tmp_path: Path, tail: str) -> None:
    path = tmp_path / "run.lvm"
    path.write_text(_lvm(tail), encoding="utf-8")
    record = imported(path)
    assert record.angle_deg == pytest.approx(20 * SINE, abs=1e-5)
    assert stem(path) == "run"


def test_columns_of_text_are_named_and_left_out(tmp_path: Path) -> None:
    rows = [
        f"2026-03-01;{5 * k},0;{value:.6f};{20 * value:.6f};{'start' if k == 9 else ''}".replace(".", ",")
        for k, value in enumerate(0.2 * SINE)
    ]
    path = tmp_path / "unknown.csv"
    path.write_text("Datum;Zeit;Soll (MPa);Winkel;Bemerkung\n" + "\n".join(rows) + "\n", encoding="utf-8")
    assert "not imported, as they hold text: 'Datum', 'Bemerkung'" in guess(path).meaning
    assert imported(path).dp_cmd_mpa == pytest.approx(0.2 * SINE, abs=1e-6)


def test_a_cell_that_is_no_number_among_numbers_is_named(tmp_path: Path) -> None:
    path = table(tmp_path, "time,cmd,angle", 0.005 * T, SINE, 20 * SINE)
    lines = path.read_text().split("\n")
    lines[7] = lines[7].rpartition(",")[0] + ",#NV"
    path.write_text("\n".join(lines))
    with pytest.raises(RecordError, match=r"row 8: angle: '#NV' is not a number"):
        guess(path)


def test_a_line_of_units_below_the_header_is_read(tmp_path: Path) -> None:
    path = table(
        tmp_path, "T,Soll,P A,P B,Phi\n[ms],[bar],kPa,kPa,mrad", 5.0 * T, 2 * SINE, 200 + 99 * SINE, 200 - 99 * SINE,
        350 * SINE,
    )  # fmt: skip
    found = guess(path)
    assert found.mapping["units_row"] is True
    assert {name: one["unit"] for name, one in found.mapping["columns"].items()} == {
        "t_s": "ms", "dp_cmd_mpa": "bar", "p1_mpa": "kPa", "p2_mpa": "kPa", "angle_deg": "mrad"
    }  # fmt: skip
    record = imported(path)
    assert record.angle_deg == pytest.approx(np.degrees(0.35 * SINE))
    assert record.period_s == pytest.approx(0.005)


def test_an_angle_that_is_small_is_told_as_doubtful(tmp_path: Path) -> None:
    small = guess(table(tmp_path, "time,cmd,angle", 0.005 * T, SINE, 2 * SINE))
    assert "'angle' is taken for radians because it stays within 2; is it in degrees?" in small.doubts
    stated = guess(table(tmp_path, "time,cmd,angle [rad]", 0.005 * T, SINE, 2 * SINE))
    assert not any("radians" in line for line in stated.doubts)


def test_a_table_as_windows_writes_it(tmp_path: Path) -> None:
    path = table(tmp_path, "Zeit [s],Soll [bar],Gelenk [\N{DEGREE SIGN}]", 0.005 * T, SINE, 20 * SINE)
    path.write_bytes(path.read_text(encoding="utf-8").encode("cp1252"))
    assert guess(path).mapping["columns"]["angle_deg"]["unit"] == "\N{DEGREE SIGN}"
    assert imported(path).angle_deg == pytest.approx(20 * SINE)


def test_a_pressure_that_rises_is_no_time(tmp_path: Path) -> None:
    path = table(tmp_path, "cmd [bar],angle [deg],p1 [bar]", 0.01 * T, 20 * SINE, SINE)
    with pytest.raises(RecordError, match=r"no column of numbers rises from row to row .* `period_s: 0.005`"):
        guess(path)


@pytest.mark.parametrize("words", [["--mapping", "m.yaml"], ["--tag", "load=2"], ["--note", "why", "--mapping", "m"]])
def test_a_guess_takes_nothing_of_an_import(tmp_path: Path, words: list[str]) -> None:
    from rig.cli.log import import_

    path = table(tmp_path, "time,cmd,angle", 0.005 * T, SINE, 20 * SINE)
    done = CliRunner().invoke(import_, [str(path), "--guess", *words])
    assert done.exit_code == 2
    assert "--guess imports nothing and takes no --" in done.output


def test_the_real_records_are_guessed_right(shared: Path) -> None:
    wrist = guess(shared / "real/porcaro_wrist/exp3_sweep_20260211.csv")
    assert {name: one["source"] for name, one in wrist.mapping["columns"].items()} == {
        "t_s": "t_s",
        "p1_cmd_mpa": "u_cmd_DF_MPa",
        "p2_cmd_mpa": "u_cmd_F_MPa",
        "p1_mpa": "y_meas_DF_MPa",
        "p2_mpa": "y_meas_F_MPa",
        "angle_deg": "y_wrist_angle_deg",
    }
    servo = guess(shared / "real/xl330_gain/kp100/sin_sin.csv.gz")
    assert servo.mapping["channels"]["input"]["name"] == "goal"
    assert servo.mapping["columns"]["output"] == {"source": "position_rad", "unit": "rad"}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("only words\nand more\n", "no header with rows of numbers"),
        ("a,b,c\n3,1,1\n2,2,2\n1,3,3\n1,3,3\n", "no column of numbers rises"),
        ("t,a,b\n0,1,1\n1,1,1\n2,1,1\n3,1,2\n", "a command and an answer are needed"),
    ],
)
def test_what_is_no_record_is_refused(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "other.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(RecordError, match=said):
        guess(path)


@pytest.mark.parametrize("remark", ["", ",ok"])
def test_a_table_is_read_from_the_disk_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, remark: str) -> None:
    """Somebody may be writing it: names, rows and stamps are those of one moment."""
    path = table(tmp_path, "time,cmd,p1,p2,angle", 0.005 * T, 0.2 * SINE, 0.2 - 0.1 * SINE, 0.2 + 0.1 * SINE, 20 * SINE)
    path.write_text("".join(f"{line}{remark}\n" for line in path.read_text().splitlines()))
    read_bytes, reads = Path.read_bytes, []

    def counted(self: Path) -> bytes:
        reads.append(self)
        return read_bytes(self)

    monkeypatch.setattr(Path, "read_bytes", counted)
    assert set(guess(path).mapping["columns"]) == {"t_s", "dp_cmd_mpa", "p1_mpa", "p2_mpa", "angle_deg"}
    assert reads == [path]
