"""What a raw-data test says: of earlier days only where there are any, and of jitter no more digits than it has."""

import numpy as np

from rig.gap.raw_tests.all_tests import read_signatures
from rig.gap.raw_tests.signature import on_days
from rig.gap.records.pairs import pair_up
from rig.record import Record


def day(seed: int) -> Record:
    """A sweep on a 12-bit converter, which now and then falls to a rail."""
    time_s = np.arange(0.0, 20.0, 0.005)
    command = 0.2 * np.sin(np.pi * time_s)
    angle = 100.0 * command + np.random.default_rng(seed).normal(0.0, 0.05, len(time_s))
    angle = np.round(angle / 0.0842) * 0.0842
    angle[100::700] = -180.0
    return Record("sine_0.5hz_0.20mpa", time_s, command, angle)


def texts(days: list[list[Record]]) -> dict[str, str]:
    return {one.test: one.text for one in read_signatures(pair_up([day(9)], days, 0.2).pairs)}


def test_without_an_earlier_day_none_is_spoken_of() -> None:
    said = texts([])
    assert {"quantisation step", "repeated samples", "drop-outs", "mains line", "time stamps"} <= set(said)
    assert not [text for text in said.values() if "earlier" in text or "baseline" in text]


def test_what_the_earlier_days_show_stands_beside_it() -> None:
    said = texts([[day(1)], [day(2)]])
    for name in ("quantisation step", "repeated samples", "drop-outs", "mains line"):
        assert " on the earlier days" in said[name], said[name]
    assert not [text for text in said.values() if "baseline" in text]


def test_jitter_of_what_numbers_are_rounded_to_is_told_as_less_than_it_matters() -> None:
    assert texts([])["time stamps"] == "0 gaps in the time stamps, jitter less than 0.01 % of the period"


def test_nothing_is_said_of_days_that_there_are_not() -> None:
    assert (on_days("3 %", True), on_days("3 %", False)) == (", 3 % on the earlier days", "")
