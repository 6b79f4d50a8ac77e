"""The fingerprint in a model's file: made from records, written, read, and refused where it no longer belongs to the
model."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import yaml
from conftest import CONFIGS

from rig.config import unstructure
from rig.errors import ConfigError
from rig.identify.provenance import find_logs
from rig.identify.records.data import Prepared, RecordOptions, prepare
from rig.identify.response.fingerprint import make_fingerprint
from rig.identify.search.stability import SweepRange
from rig.identify.validate import validate
from rig.model.fingerprint import Fingerprint, PressureSource
from rig.model.parameters import AddedEffect, Input, Model, SourceLog, load_model, save_model
from rig.model.response.fingerprint_check import fingerprint_checksum, fingerprint_trouble
from rig.model.response.kept_day import unpacked
from rig.model.response.model import regulators_of, response_of
from rig.model.simulation import simulate
from rig.record import Column, Record

MODELS = CONFIGS / "models"
RIG = load_model(MODELS / "simulated.yaml")
ROWS = 2400


def measured(frequency_hz: float, p0_mpa: float = 0.2) -> Record:
    """What the simulated rig shows under a sine of 0.2 MPa, with noise."""
    t = np.arange(ROWS) * 0.005
    half = 0.1 * np.sin(2 * np.pi * frequency_hz * t)
    record = Record(f"sine_{frequency_hz:g}hz", t, 2 * half, p1_cmd_mpa=p0_mpa + half, p2_cmd_mpa=p0_mpa - half)
    clean, noise = simulate(RIG, record), np.random.default_rng(int(100 * frequency_hz + 1000 * p0_mpa))
    columns = {
        name: getattr(clean, name) + noise.normal(0.0, size, ROWS)
        for name, size in (("p1_mpa", 4e-4), ("p2_mpa", 4e-4), ("angle_deg", 0.03))
    }
    return replace(clean, **columns)


def prepared(*frequencies: float) -> list[Prepared]:
    return [prepare(measured(frequency), RIG) for frequency in frequencies]


def made(data: list[Prepared], model: Model = RIG) -> Fingerprint:
    known = make_fingerprint(data, model)
    assert known is not None
    return known


@cache
def fingerprint() -> Fingerprint:
    return made(prepared(0.2, 0.5, 0.8))


def with_fingerprint() -> Model:
    return replace(RIG, fingerprint=fingerprint())


@pytest.fixture
def file(tmp_path: Path) -> Path:
    save_model(with_fingerprint(), tmp_path / "model.yaml")
    return tmp_path / "model.yaml"


def test_it_says_what_was_seen_and_how_well_it_is_known() -> None:
    assert fingerprint().pressures is PressureSource.MEASURED
    assert fingerprint().records == 3
    assert fingerprint().seconds == pytest.approx(36.0, abs=0.2)
    assert fingerprint().noise_deg == pytest.approx(0.03, rel=0.1)
    assert fingerprint().noise_mpa == pytest.approx((4e-4, 4e-4), rel=0.1)
    for valve, tau in enumerate((0.040, 0.045)):
        dead, fill, exhaust = fingerprint().regulators_s[valve]
        assert dead + fill == pytest.approx(tau + 0.0075, abs=0.003), (
            "a set-point acts from the next row on, which counts as dead time"
        )
        assert exhaust == pytest.approx(fill, abs=0.002)
    assert fingerprint().misfit_deg < 0.6
    assert max(fingerprint().misfit_mpa) < 4e-4
    assert fingerprint().left_out_deg is not None
    assert fingerprint().left_out_deg > fingerprint().misfit_deg, "a record that the fit has not seen"
    assert fingerprint().drive_mpa == pytest.approx((-0.2, 0.2), abs=0.01)
    assert fingerprint().mean_mpa == pytest.approx((0.2, 0.2), abs=0.01)


def test_it_predicts_a_sweep_that_it_has_not_seen() -> None:
    record = measured(0.35)
    assert record.p1_mpa is not None
    assert record.p2_mpa is not None
    assert record.angle_deg is not None
    said = response_of(fingerprint()).angle(record.p1_mpa, record.p2_mpa, 0.005)
    assert np.sqrt(np.mean((said - record.angle_deg)[200:] ** 2)) < 1.0, "of an angle of 70 deg peak to peak"


def test_two_records_leave_none_out_and_a_start_that_is_skipped_does_not_count() -> None:
    two = made(prepared(0.2, 0.5))
    assert two.left_out_deg is None
    assert two.left_out_mpa == ()
    record = measured(0.5)
    assert record.angle_deg is not None
    broken = replace(record, angle_deg=np.where(record.t_s < 2.0, 60.0, record.angle_deg))
    skipped = made([prepare(broken, RIG, RecordOptions(skip_s=2.5))])
    assert skipped.misfit_deg < 0.6
    assert skipped.seconds == pytest.approx(9.5, abs=0.1)


def test_without_pressures_they_are_those_of_the_models_regulators_or_usual_ones() -> None:
    bare = replace(measured(0.5), p1_mpa=None, p2_mpa=None)
    by_command = replace(RIG, muscle=replace(RIG.muscle, input=Input.COMMAND))
    known = made([prepare(bare, by_command)])
    assert known.pressures is PressureSource.VIRTUAL
    assert known.misfit_mpa == known.noise_mpa == ()
    assert known.regulators_s == regulators_of(RIG)
    assert known.misfit_deg < 1.0
    usual = made([prepare(bare, by_command)], replace(RIG, valve=load_model(MODELS / "paper_table3.yaml").valve))
    assert usual.regulators_s == regulators_of(None)


BY_COMMAND = replace(RIG, muscle=replace(RIG.muscle, input=Input.COMMAND))
HOLES = np.where(np.arange(ROWS) % 2 == 0, np.nan, 0.2)


@pytest.mark.parametrize(
    "monitor", [np.full(ROWS, np.nan), HOLES, np.full(ROWS, 0.2)], ids=["silent", "half missing", "stuck"]
)
def test_monitors_that_say_nothing_are_not_used(monitor: Column) -> None:
    record = replace(measured(0.5), p1_mpa=monitor, p2_mpa=monitor)
    known = made([prepare(record, BY_COMMAND)])
    assert known.pressures is PressureSource.VIRTUAL
    assert np.isfinite([known.misfit_deg, known.noise_deg, *known.weights]).all()


def test_a_logger_that_stores_every_fourth_packet_twice_still_shows_the_pressures() -> None:
    record = measured(0.5)
    twice = np.arange(ROWS) - (np.arange(ROWS) % 4 == 3)
    columns = {name: getattr(record, name)[twice] for name in ("p1_mpa", "p2_mpa", "angle_deg")}
    known = made([prepare(replace(record, **columns), RIG)])
    assert known.pressures is PressureSource.MEASURED
    assert known.misfit_deg < 0.6


def test_records_that_are_too_short_or_have_no_whole_command_leave_none() -> None:
    record = measured(0.5)
    gap = replace(record, dp_cmd_mpa=np.nan * record.t_s, p1_cmd_mpa=None, p2_cmd_mpa=None)
    assert make_fingerprint([prepare(gap, RIG)], RIG) is None
    assert make_fingerprint([prepare(record.rows(slice(0, 220)), RIG)], RIG) is None
    assert make_fingerprint([prepare(record, RIG, RecordOptions(skip_s=11.9))], RIG) is None
    both = made([prepare(record, RIG), prepare(gap, RIG)])
    assert both.records == 1


def test_it_comes_back_from_the_file_as_it_was(file: Path) -> None:
    again = load_model(file)
    assert again == with_fingerprint()
    assert fingerprint_trouble(again) is None
    numbers, _, records = file.read_text(encoding="utf-8").partition("fingerprint:")[2].partition("  day: |\n")
    assert len(numbers.splitlines()) < 30, "rows of numbers stand on one line"
    assert "".join(records.split()) == "".join(fingerprint().day.split())


def test_a_checksum_never_looks_like_a_number(tmp_path: Path) -> None:
    """0e1234567890 and 3e4797112345 are twelve hexadecimal digits, and numbers as well."""
    assert fingerprint().checksum.startswith("sha-")
    save_model(
        replace(with_fingerprint(), fingerprint=replace(fingerprint(), checksum="sha-3e4797112345")),
        tmp_path / "model.yaml",
    )
    assert "changed" in str(fingerprint_trouble(load_model(tmp_path / "model.yaml")))


def test_a_negative_zero_is_no_change(tmp_path: Path) -> None:
    minus = replace(fingerprint(), viscous_s=-0.0, checksum="")
    save_model(
        replace(RIG, fingerprint=replace(minus, checksum=fingerprint_checksum(minus, RIG))), tmp_path / "model.yaml"
    )
    assert fingerprint_trouble(load_model(tmp_path / "model.yaml")) is None


def test_a_model_without_one_reads_as_ever() -> None:
    assert RIG.fingerprint is None
    assert fingerprint_trouble(RIG) is None


def test_the_records_are_kept_on_the_models_clock() -> None:
    kept = unpacked(fingerprint().day)
    assert [record.name for record in kept] == ["sine_0.2hz", "sine_0.5hz", "sine_0.8hz"]
    for mine, record in zip(prepared(0.2, 0.5, 0.8), kept, strict=True):
        assert record.period_s == pytest.approx(RIG.sample_time_s)
        assert record.angle_deg is not None
        assert np.std(record.angle_deg - mine.angle_deg) == pytest.approx(0.03, rel=0.1), "its noise is not kept"


def test_a_file_of_version_2_keeps_no_records_and_stays_good(file: Path) -> None:
    second = replace(fingerprint(), version=2, day="")
    save_model(replace(RIG, fingerprint=replace(second, checksum=fingerprint_checksum(second, RIG))), file)
    assert "day:" not in file.read_text(encoding="utf-8")
    model = load_model(file)
    assert fingerprint_trouble(model) is None
    assert fingerprint_checksum(second, RIG) != fingerprint_checksum(fingerprint(), RIG)


@pytest.mark.parametrize("former", [{}, {"compliance": 1.0}])
def test_a_file_that_was_written_when_stiffness_had_an_exponent_stays_good(
    file: Path, former: dict[str, float]
) -> None:
    """Nothing ever found another exponent than 1: it is gone, and still counts in the checksums of then."""
    assert "compliance" not in unstructure(fingerprint())
    raw = yaml.safe_load(file.read_text(encoding="utf-8"))
    raw["fingerprint"] = {"version": 2, "checksum": "sha-60dc075db588", "records": 3, "seconds": 30.0, "p0_mpa": 0.2,
                          "weights": [0.5, 1.0], "exponent": 0.9, "misfit_deg": 0.1} | former  # fmt: skip
    file.write_text(yaml.safe_dump(raw), encoding="utf-8")
    known = load_model(file).fingerprint
    assert known is not None
    assert fingerprint_trouble(replace(RIG, fingerprint=known)) is None


def test_a_file_of_version_1_has_no_corrections_and_stays_good(file: Path) -> None:
    first = replace(fingerprint(), version=1, corrections=(), day="")
    save_model(replace(RIG, fingerprint=replace(first, checksum=fingerprint_checksum(first, RIG))), file)
    model = load_model(file)
    assert fingerprint_trouble(model) is None
    assert model.fingerprint is not None
    response, u = response_of(model.fingerprint), np.linspace(0.15, 0.25, 400)
    assert np.array_equal(response.monitored(u, u, 0.01), response.pressures(u, u, 0.01))


def test_what_a_regulator_is_beside_a_lag_is_kept() -> None:
    def droops(record: Record) -> Record:
        return replace(record, p1_mpa=0.2 + 0.95 * (record.p1_mpa - 0.2) + 0.002)

    seen, other = (droops(measured(f)) for f in (0.2, 0.5))
    days = [prepare(seen, RIG), prepare(droops(measured(0.8)), RIG)]
    assert not any(made(days).corrections[0]), "two records cannot prove it"
    response = response_of(made([*days, prepare(droops(measured(0.35)), RIG)]))
    commands = other.p1_cmd_mpa[::2].copy(), other.p2_cmd_mpa[::2].copy()
    shown = response.monitored(*commands, 0.01)[0][20:]
    without = response.pressures(*commands, 0.01)[0][20:]
    assert np.std(other.p1_mpa[::2][20:] - without) > 2e-3, "no lag has a gain"
    assert np.std(other.p1_mpa[::2][20:] - shown) < 6e-4, "on a record that it was not fitted to"


def test_a_newer_version_is_said_in_one_line_and_the_model_works_without_it(file: Path) -> None:
    raw = yaml.safe_load(file.read_text(encoding="utf-8"))
    raw["fingerprint"] = {"version": 4, "spectrum": {"lines": [1, 2]}, "weights": "base64"}
    file.write_text(yaml.safe_dump(raw), encoding="utf-8")
    model = load_model(file)
    assert (
        fingerprint_trouble(model)
        == "the model's fingerprint is of version 4, this pamrig reads versions up to 3: it is not used"
    )
    result = validate(model, [measured(0.5)], SweepRange())
    assert result.scores[0].rmse_deg < 0.2
    assert [text for text in result.warnings if "version 4" in text]


def edited(model: Model, change: str) -> Model:
    known = model.fingerprint
    assert known is not None
    if change == "misfit":
        return replace(model, fingerprint=replace(known, misfit_deg=0.001))
    if change == "weights":
        return replace(model, fingerprint=replace(known, weights=known.weights[:-1]))
    if change == "effect":
        return replace(model, effects=[AddedEffect("valve_lag", {"tau_s": 0.1})])
    if change == "p0":
        return replace(model, p0_mpa=0.25)
    parameters = model.muscle.parameters
    xi = replace(parameters["xi1"], value=1.0001 * parameters["xi1"].value)
    return replace(model, muscle=replace(model.muscle, parameters=parameters | {"xi1": xi}))


@pytest.mark.parametrize("change", ["misfit", "weights", "effect", "p0", "parameter"])
def test_what_was_changed_after_the_identification_is_not_used(change: str, tmp_path: Path) -> None:
    save_model(edited(with_fingerprint(), change), tmp_path / "model.yaml")
    trouble = fingerprint_trouble(load_model(tmp_path / "model.yaml"))
    assert trouble is not None
    assert "changed after the identification" in trouble


def test_bounds_and_free_marks_may_change() -> None:
    free = {name: replace(each, free=not each.free) for name, each in with_fingerprint().muscle.parameters.items()}
    assert (
        fingerprint_trouble(replace(with_fingerprint(), muscle=replace(with_fingerprint().muscle, parameters=free)))
        is None
    )


def test_a_word_that_no_version_knows_is_refused_in_one_line(file: Path) -> None:
    file.write_text(file.read_text(encoding="utf-8").replace("misfit_deg:", "misfit_degree:"), encoding="utf-8")
    with pytest.raises(ConfigError, match=r"fingerprint: unknown key 'misfit_degree'; did you mean 'misfit_deg'\?"):
        load_model(file)


def source(folder: Path, name: str, text: str) -> tuple[Path, SourceLog]:
    import hashlib

    folder.mkdir(exist_ok=True)
    (folder / name).write_text(text, encoding="utf-8")
    return folder / name, SourceLog(str(folder / name), hashlib.sha256(text.encode()).hexdigest(), name, 0.1)


def test_the_logs_are_found_where_they_were_or_by_their_content(tmp_path: Path) -> None:
    stays, one = source(tmp_path / "a", "one.csv", "1")
    moved, two = source(tmp_path / "a", "two.csv", "2")
    changed, three = source(tmp_path / "a", "three.csv", "3")
    model = replace(RIG, provenance=replace(RIG.provenance, logs=[one, two, two, three]))
    new = tmp_path / "b" / "deeper" / "renamed.csv"
    new.parent.mkdir(parents=True)
    moved.rename(new)
    changed.write_text("4", encoding="utf-8")
    assert find_logs(model, tmp_path / "b") == (
        [stays, new],
        [f"{changed}: its content has changed since the identification, nor is it in {tmp_path / 'b'}"],
    )
    assert find_logs(model)[0] == [stays]
    assert find_logs(model)[1][0] == f"{moved}: no such file"
