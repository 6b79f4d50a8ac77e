"""A monitor that shows one value again and again was not read: its rows are left out, and a pressure that stands is not
one."""

from dataclasses import replace

import numpy as np
import pytest
from support.plants.gap_rigs import model, session

from rig.gap.diagnosis import diagnose
from rig.gap.records.cleaning.stuck_monitors import stuck, without_stuck_monitors
from rig.record import Column, Record

ROWS, PERIOD_S = 4000, 0.005
SET_POINT = 0.2 + 0.05 * np.sin(2 * np.pi * 0.5 * PERIOD_S * np.arange(ROWS))
STILL = slice(1000, 1400)


def monitor(noise_mpa: float = 0.001, step_mpa: float = 0.0, pressure: Column = SET_POINT) -> Column:
    read: Column = pressure + np.random.default_rng(3).normal(0.0, noise_mpa, ROWS)
    return step_mpa * np.round(read / step_mpa) if step_mpa else read


def hung(column: Column, rows: slice = STILL) -> Column:
    out = column.copy()
    out[rows] = out[rows.start]
    return out


@pytest.mark.parametrize("step_mpa", [0.0, 0.00025, 0.001])
def test_one_value_where_it_flickers_else_was_not_read(step_mpa: float) -> None:
    rows = stuck(hung(monitor(step_mpa=step_mpa)), SET_POINT, PERIOD_S)
    assert rows[STILL].mean() > 0.99
    assert rows.sum() <= STILL.stop - STILL.start + 2


@pytest.mark.parametrize(
    ("column", "set_point"),
    [
        (monitor(), SET_POINT),
        (monitor(pressure=hung(SET_POINT)), SET_POINT),
        (hung(monitor(noise_mpa=0.0)), SET_POINT),
        (hung(monitor(noise_mpa=0.0003, step_mpa=0.002)), SET_POINT),
        (hung(monitor()), hung(SET_POINT)),
        (hung(monitor(), slice(1000, 1040)), SET_POINT),
        (np.minimum(monitor(), 0.22), SET_POINT),
        (np.maximum(monitor(), 0.17), SET_POINT),
    ],
    ids=[
        *("alive", "a pressure that stands", "no noise to tell by", "a coarse converter", "nothing is asked"),
        *("shortly", "clipped above", "clipped below"),
    ],
)
def test_what_may_stand_rightly_is_kept(column: Column, set_point: Column) -> None:
    assert not stuck(column, set_point, PERIOD_S).any()


def test_a_monitor_that_hangs_is_told_and_is_no_leak() -> None:
    def hangs(record: Record) -> Record:
        assert record.p1_mpa is not None
        noisy = record.p1_mpa + np.random.default_rng(len(record)).normal(0.0, 0.0005, len(record))
        return replace(record, p1_mpa=hung(noisy, slice(len(record) // 4, len(record) // 2)))

    heard, said = without_stuck_monitors([hangs(record) for record in session(92)])
    assert [np.isnan(record.p1_mpa).mean() > 0.2 for record in heard] == [True] * len(heard)
    assert len(said) == 1
    found = diagnose(model(), session(92, after=hangs))
    assert found.verdict == "none"
    assert [one.text for one in found.observations if one.test == "stuck monitor"] == said
