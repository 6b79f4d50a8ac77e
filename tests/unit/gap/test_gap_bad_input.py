"""Input that cannot be right, in every way of asking: one clear line or an honest answer, never a confident wrong
name."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from support.plants.gap_rigs import baselines, identified, session

from rig.errors import RigError
from rig.gap import diagnose
from rig.gap.answer.consistency import contradictions
from rig.gap.answer.result import Diagnosis
from rig.gap.records.holes import holes_of, unsettled, with_rows
from rig.model.parameters import AddedEffect, Model
from rig.record import Column, Record

Made = Callable[[Record], Record]
SURE = 0.5
"""Above, a name is a confident one."""
WAYS = ("sessions", "session", "fingerprint", "simulator", "sister")


def ask(way: str, records: list[Record], pressures: bool = True, library: list[str] | None = None) -> Diagnosis:
    days = {"sessions": baselines(), "session": baselines()[:1]}.get(way, ())
    bare = replace(identified(), fingerprint=None)
    simulator: Model = bare if way in ("simulator", "sister") else identified()
    reference = "simulator" if way == "sister" else "auto"
    return diagnose(simulator, records, days, pressures=pressures, reference=reference, library=library)


def healthy(made: Made, count: int = 2) -> list[Record]:
    """So many records of a healthy day: for an answer the two slower ones are enough."""
    return [made(record) for record in session(303)[:count]]


def of(**columns: Callable[[Record], Column | None]) -> Made:
    """The record with these columns instead of its own."""
    return lambda record: replace(record, **{name: law(record) for name, law in columns.items()})  # type: ignore[arg-type]


def clipped(column: Column) -> Column:
    middle = 0.5 * (column.max() + column.min())
    return np.clip(column, None, middle + 0.2 * np.ptp(column))


def angle(record: Record) -> Column:
    assert record.angle_deg is not None
    return record.angle_deg


REFUSED: dict[str, tuple[Made, str]] = {
    "less than 2 s": (lambda record: record.rows(record.t_s < 1.5), "too short"),
    "no excitation": (of(dp_cmd_mpa=lambda r: 0.0 * r.dp_cmd_mpa), "no excitation"),
    "both monitors swapped": (of(p1_mpa=lambda r: r.p2_mpa, p2_mpa=lambda r: r.p1_mpa), "runs against its command"),
    "pressures in kPa": (of(p1_mpa=lambda r: 1e3 * r.p1_mpa, p2_mpa=lambda r: 1e3 * r.p2_mpa), "is it in kPa"),
    "one pressure in kPa": (of(p2_mpa=lambda r: 1e3 * r.p2_mpa), "is it in kPa"),
    "pressures in bar": (of(p1_mpa=lambda r: 10 * r.p1_mpa, p2_mpa=lambda r: 10 * r.p2_mpa), "is it in bar"),
    "commands in bar": (of(dp_cmd_mpa=lambda r: 10 * r.dp_cmd_mpa), "times as far as the rig|differs by"),
    "angle in radians": (of(angle_deg=lambda r: np.deg2rad(angle(r))), "radians|times as far as the rig"),
    "angle turned round": (of(angle_deg=lambda r: -angle(r)), "the angle runs against"),
    "time in ms": (of(t_s=lambda r: 1e3 * r.t_s), "is the time in ms"),
}


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("what", REFUSED)
def test_what_cannot_be_right_is_one_clear_line(what: str, way: str) -> None:
    made, said = REFUSED[what]
    with pytest.raises(RigError, match=said) as refused:
        ask(way, healthy(made, 3))
    assert "\n" not in str(refused.value)


def holed(record: Record) -> Record:
    return record.rows((record.t_s < 2.5) | ((record.t_s >= 3.5) & (record.t_s < 7.5)) | (record.t_s >= 8.25))


def uneven(record: Record) -> Record:
    t = record.t_s + np.random.default_rng(3).uniform(-0.002, 0.002, len(record))
    columns = {name: np.interp(t, record.t_s, column) for name, column in record.columns().items()}
    return replace(record, **columns | {"t_s": t})  # type: ignore[arg-type]


POOR: dict[str, Made] = {
    "less than two periods": lambda record: record.rows(record.t_s < 2.5),
    "holes": holed,
    "20 ms": lambda record: record.rows(slice(None, None, 4)),
    "irregular": uneven,
    "a pressure missing": of(p1_mpa=lambda r: None),
    "a monitor stands still": of(p1_mpa=lambda r: np.full(len(r), 0.2)),
}


@pytest.mark.parametrize("way", WAYS[1:])
@pytest.mark.parametrize("what", POOR)
def test_poor_records_of_a_healthy_rig_are_no_finding(what: str, way: str) -> None:
    assert ask(way, healthy(POOR[what])).verdict == "none"


@pytest.mark.parametrize("what", ["20 ms", "irregular"])
def test_another_sampling_than_the_earlier_days_is_no_noise(what: str) -> None:
    assert ask("sessions", healthy(POOR[what])).verdict == "none"


def test_noise_is_still_found_in_coarse_records() -> None:
    noisy = [POOR["20 ms"](record) for record in session(301, after=_noisy)]
    assert [cause.effect for cause in ask("session", noisy).causes] == ["sensor_noise"]


def _noisy(record: Record) -> Record:
    return replace(record, angle_deg=angle(record) + 0.3 * np.random.default_rng(5).standard_normal(len(record)))


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("column", ["angle_deg", "p1_mpa"])
def test_a_clipped_sensor_gives_no_confident_name(column: str, way: str) -> None:
    found = ask(way, healthy(of(**{column: lambda r: clipped(getattr(r, column))})))
    assert any("clipped?" in note for note in found.notes)
    assert found.causes or way == "sister", "which may itself miss what a monitor does"
    assert all(cause.confidence <= SURE for cause in found.causes if cause.effect != "unknown")
    assert contradictions(found.to_json()) == []
    surer = [replace(cause, confidence=SURE + 0.1) for cause in found.causes]
    taken_back = contradictions(replace(found, causes=surer, confidence=0.0).to_json())
    clips = [note for note in found.notes if "clipped?" in note]
    assert [note for note in clips for _ in surer] == sorted(
        (line.rpartition("takes it back: ")[2] for line in taken_back), key=clips.index
    ), "each note that doubts all names is in the way of a surer one"


def at_another_p0(said: bool) -> list[Record]:
    told = {"p0_mpa": 0.3} if said else {}
    return [
        replace(record, facts={**record.facts, **told}, p1_mpa=record.p1_mpa + 0.1, p2_mpa=record.p2_mpa + 0.1)
        for record in session(303)
        if record.p1_mpa is not None and record.p2_mpa is not None
    ]


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("said", [True, False])
def test_another_p0_is_said_or_refused_and_no_confident_name(way: str, said: bool) -> None:
    records = at_another_p0(said)
    if said and way in ("sessions", "session"):
        with pytest.raises(RigError, match=r"p0_mpa is 0.3, not 0.2 \(allowed: 0.03 off\)"):
            ask(way, records)
        return
    found = ask(way, records)
    assert any("P0 is 0.30 MPa by the measured pressures" in note for note in found.doubts) is not said
    assert found.causes == [] if said else found.causes
    assert all(cause.confidence <= SURE for cause in found.causes if cause.effect != "unknown")


@pytest.mark.parametrize("way", WAYS)
def test_with_no_effect_left_in_the_library_nothing_is_named(way: str) -> None:
    found = ask(way, session(301, AddedEffect("valve_lag", {"tau_s": 0.04})), library=[])
    assert all(cause.effect == "unknown" for cause in found.causes)
    assert found.verdict == "unknown" or way == "sister", "of which a slower valve is no surprise"


def test_the_command_of_the_same_sweep_stands_in_a_hole() -> None:
    whole, record = session(303)[0], holed(session(303)[0])
    assert holes_of(record) == [(2.495, 3.5), (7.495, 8.25)]
    known = with_rows(record, [whole])
    assert len(known) == len(whole)
    assert np.allclose(known.dp_cmd_mpa, whole.dp_cmd_mpa, atol=1e-9)
    assert np.isnan(angle(known)).mean() == pytest.approx(1.75 / 12.0, abs=0.01)
    assert not unsettled(record, [whole], whole.t_s).any()


def test_after_a_command_that_nobody_knows_rows_count_once_it_has_gone_through_its_range() -> None:
    record = holed(session(303)[0])
    rows = unsettled(record, [], session(303)[0].t_s)
    t = session(303)[0].t_s
    assert rows[t == 3.0].all()
    assert not rows[t == 2.4].any()
    assert not rows[(t > 6.5) & (t < 7.4)].any(), "a sine of 0.3 Hz has been through its range by then"
