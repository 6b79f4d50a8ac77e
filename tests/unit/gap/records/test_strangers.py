"""Earlier days that no other comes near: left out whole, and named as they were given."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from rig.gap.records.pairs import pair_up
from rig.gap.records.strangers import without_strangers
from rig.record import Record

T = np.arange(0.0, 10.0, 0.005)


def day(seed: int, gain: float = 1.0) -> Record:
    """A joint of 100 deg/MPa under a sine, with a little noise of its own."""
    command = 0.1 * np.sin(np.pi * T)
    noise = np.random.default_rng(seed).normal(0.0, 0.02, len(T))
    return Record("sine", T, command, angle_deg=100.0 * gain * command + noise)


def fallen(record: Record) -> Record:
    """The same with a sample fallen to zero every half second."""
    angle = np.array(record.angle_deg)
    angle[20::100] = 0.0
    return replace(record, angle_deg=angle)


def test_a_stranger_has_the_number_and_the_folder_that_it_was_given_with() -> None:
    sick = replace(day(5, gain=1.3), source=Path("sunday") / "sine.csv")
    pairing = without_strangers(pair_up([day(0)], [[day(1)], [day(1)], [sick], [day(2)], [day(3)]], 0.2))
    assert pairing.sessions == 3
    assert pairing.pairs[0].numbers == (1, 4, 5)
    told = [note for note in pairing.notes if "differs from every other" in note]
    assert [note.partition(" differs")[0] for note in told] == ["baseline session 3 (sunday)"]
    again = next(note for note in pairing.notes if "repeats records" in note)
    assert again.startswith("baseline session 2 repeats")


def test_what_fell_on_a_day_that_is_left_out_does_not_count_as_the_rigs_own() -> None:
    pairing = pair_up([day(0)], [[day(1)], [fallen(day(5, gain=1.3))], [day(2)], [day(3)]], 0.2)
    assert [len(mine) > 0 for mine in pairing.pairs[0].baseline_dropouts] == [False, True, False, False]
    kept = without_strangers(pairing)
    assert kept.sessions == 3
    assert not any(kept.pairs[0].baseline_dropouts)
