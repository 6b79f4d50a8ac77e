"""A rig that no response model describes: with its records in the model's file it is known as by an earlier day."""

from dataclasses import replace

import numpy as np
import pytest
from support.plants.gap_rigs import SWEEPS, model, session

from rig.app.model.identifying import SearchOptions, StartOptions, identify_model
from rig.gap import diagnose
from rig.gap.answer.result import Diagnosis
from rig.gap.records.fingerprint_records import pair_with_kept
from rig.identify.records.data import RecordOptions
from rig.identify.response.fingerprint import fingerprint_of
from rig.identify.search.stability import SweepRange
from rig.model.parameters import AddedEffect, Model
from rig.model.response.fingerprint_check import fingerprint_checksum
from rig.record import Record

COG_DEG, PER_DEG = 0.4, 2.0


def cogged(record: Record) -> Record:
    """The rig with a joint that cogs like a stepper motor: nothing of a response model repeats every 3 deg."""
    assert record.angle_deg is not None
    return replace(record, angle_deg=record.angle_deg + COG_DEG * np.sin(PER_DEG * record.angle_deg))


@pytest.fixture(scope="module")
def known() -> Model:
    plain = model()
    return replace(plain, fingerprint=fingerprint_of(session(80, after=cogged), plain))


def by_response(known: Model) -> Model:
    """The same as a file of version 2 has it."""
    assert known.fingerprint is not None
    old = replace(known.fingerprint, version=2, day="")
    return replace(known, fingerprint=replace(old, checksum=fingerprint_checksum(old, known)))


def asked(simulator: Model, *effects: AddedEffect) -> Diagnosis:
    return diagnose(simulator, session(81, *effects, after=cogged), reference="fingerprint")


def test_a_healthy_rig_is_told_to_be_closer_than_the_response_model_can_say(known: Model) -> None:
    kept, described = asked(known), asked(by_response(known))
    assert (kept.verdict, kept.reference) == ("none", "fingerprint")
    assert kept.evidence.sessions == 1
    assert described.evidence.sessions == 0
    assert kept.gap.rms_deg < 0.5 * described.gap.rms_deg
    assert kept.gap.floor_deg < described.gap.floor_deg
    assert len(kept.evidence.pairing) == len(SWEEPS)


def test_what_is_new_is_named_with_its_size(known: Model) -> None:
    told = asked(known, AddedEffect("valve_lag", {"tau_s": 0.008}))
    assert [cause.effect for cause in told.causes] == ["valve_lag"]
    assert told.causes[0].parameters["tau_s"].value == pytest.approx(0.008, rel=0.15)
    assert told.retuning is not None, "it is still the question what the simulator lacks"


@pytest.mark.parametrize("period_s", [0.0005, 0.005], ids=["a tenth of the model's", "the model's"])
def test_what_is_kept_of_a_fast_record_is_no_earlier_than_it_was(period_s: float) -> None:
    """On the model's slower grid a command is the mean over the period that follows; laid on that, the day that is kept
    came half a period late."""
    t_s = period_s * np.arange(round(12.0 / period_s))
    command, late_s = 0.1 * np.sin(2 * np.pi * t_s), 0.03
    angle = 15.0 * np.sin(2 * np.pi * np.maximum(t_s - late_s, 0.0)) + 1e-3 * np.sin(91.0 * t_s)
    sweep = Record("sine_1hz", t_s, command, angle_deg=angle)
    start = StartOptions(None, "mbw", "auto", "rigid", 0.005, None, 0.1, False, 0.0)
    search = SearchOptions("pso", 4, 1, 10, 10, None, polish=False, bounded=False)
    found = identify_model([sweep], start, search, SweepRange(), RecordOptions(resample=True), None)
    (pair,) = pair_with_kept([sweep], found.model.fingerprint, 0.2).pairs
    speed = np.gradient(pair.case.angle_deg, pair.dt_s) * pair.used
    off_s = (pair.case.angle_deg - pair.days[0].angle_deg) @ speed / (speed @ speed)
    assert abs(off_s) < 0.0005
