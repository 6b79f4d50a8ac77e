"""Records beside those that a model's fingerprint keeps: the same sweeps pair as with an earlier day, others with
nothing."""

from dataclasses import replace

import numpy as np
import pytest
from support.plants.gap_rigs import identified, model, session

from rig.errors import RecordError
from rig.gap.records.fingerprint_records import pair_with_kept
from rig.gap.records.pairs import pair_up
from rig.model.fingerprint import Fingerprint
from rig.model.response.kept_day import packed
from rig.model.simulation import simulate
from rig.record import Record

P0_MPA = 0.2


@pytest.fixture
def known() -> Fingerprint:
    fingerprint = identified().fingerprint
    assert fingerprint is not None
    return fingerprint


def sine(name: str, hertz: float) -> Record:
    """Another sweep than those of the identification."""
    t = np.arange(0.0, 12.0, 0.005)
    return simulate(model(), Record(name, t, 0.15 * np.sin(2 * np.pi * hertz * t)), start_deg=0.0)


def test_the_same_sweeps_are_compared_with_what_the_rig_answered_then(known: Fingerprint) -> None:
    records = session(9)
    kept, day = pair_with_kept(records, known, P0_MPA), pair_up(records, [session(1)], P0_MPA)
    assert kept.day_count == 1
    assert [pair.name for pair in kept.pairs] == [record.name for record in records]
    for mine, theirs in zip(kept.pairs, day.pairs, strict=True):
        (session_kept,), (session_day,) = mine.days, theirs.days
        inner = mine.used > 0
        rest = session_kept.angle_deg[: len(theirs)][inner] - session_day.angle_deg[inner]
        assert np.std(rest) < 0.03, "no more than the noise that was not kept"
        assert session_kept.p1_mpa is not None
        assert mine.raw_days == (), "packed records show no raw samples"


def test_without_records_in_it_nothing_pairs(known: Fingerprint) -> None:
    for fingerprint in (None, replace(known, day="")):
        assert pair_with_kept(session(9), fingerprint, P0_MPA).day_count == 0


def test_other_sweeps_and_other_conditions_pair_with_nothing(known: Fingerprint) -> None:
    others = [sine(f"sine_{hertz}", hertz) for hertz in (0.2, 0.55)]
    found = pair_with_kept(others, known, P0_MPA)
    assert (found.day_count, len(found.pairs)) == (0, 2)
    loaded, bare = ([replace(each, facts={"load_kg": kg}) for each in session(9)] for kg in (2.0, 0.5))
    light = replace(known, day=packed(bare))
    assert pair_with_kept(bare, light, P0_MPA).day_count == 1
    assert pair_with_kept(loaded, light, P0_MPA).day_count == 0


@pytest.mark.parametrize(("others", "sessions", "pairs"), [(3, 1, 3), (4, 0, 7)])
def test_most_records_decide(known: Fingerprint, others: int, sessions: int, pairs: int) -> None:
    mixed = session(9) + [sine(f"other_{k}", 0.17 + 0.19 * k) for k in range(others)]
    found = pair_with_kept(mixed, known, P0_MPA)
    assert (found.day_count, len(found.pairs)) == (sessions, pairs)


def test_what_cannot_be_used_is_refused_as_ever(known: Fingerprint) -> None:
    blind = [replace(record, angle_deg=None) for record in session(9)]
    with pytest.raises(RecordError, match="no angle"):
        pair_with_kept(blind, known, P0_MPA)


def cut(record: Record, seconds: float) -> Record:
    return record.rows(record.t_s - record.t_s[0] <= seconds)


@pytest.mark.parametrize(("seconds", "alone"), [(11.8, False), (6.0, True)])
def test_records_that_last_longer_than_what_is_kept_are_compared_with_the_description(
    known: Fingerprint, seconds: float, alone: bool
) -> None:
    """Half of a record was kept: what came after it was not looked at, without a word, and found to be nothing."""
    shorter = replace(known, day=packed([cut(record, seconds) for record in session(1)]))
    assert (pair_with_kept(session(9), shorter, P0_MPA).day_count == 0) is alone


@pytest.mark.parametrize(("seconds", "said"), [(11.8, False), (6.0, True)])
def test_of_an_earlier_day_that_is_shorter_it_is_said_how_much_is_compared(seconds: float, said: bool) -> None:
    pairing = pair_up(session(9), [[cut(record, seconds) for record in session(1)]], P0_MPA)
    assert any("s have a baseline; what came after is not looked at" in note for note in pairing.notes) is said
