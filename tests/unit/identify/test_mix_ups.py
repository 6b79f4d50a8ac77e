"""Columns that are exchanged, turned round or in another unit of time are named before anybody hunts for a defect of
the rig."""

from dataclasses import replace

import numpy as np
import pytest

from rig.errors import RecordError
from rig.identify.records.data import RecordOptions, prepare
from rig.identify.records.mix_ups import mix_ups, strange_clock
from rig.identify.templates import Template, template_model
from rig.record import Record

MODEL = template_model(Template())


def good() -> Record:
    """A sine, the pressures and the angle as they follow it."""
    t_s = np.arange(2000) * 0.005
    dp = 0.2 * np.sin(np.pi * t_s)
    late = 0.2 * np.sin(np.pi * (t_s - 0.05))
    angle = 40.0 * np.sin(np.pi * t_s - 0.3)
    noise = np.random.default_rng(1).normal(0.0, 4e-4, 2000)
    return Record("sine", t_s, dp, angle_deg=angle, p1_mpa=0.2 + late / 2 + noise, p2_mpa=0.2 - late / 2 - noise)


def swapped(record: Record) -> Record:
    """The monitors' plugs exchanged."""
    return replace(record, p1_mpa=record.p2_mpa, p2_mpa=record.p1_mpa)


def test_a_good_record_is_not_suspected() -> None:
    assert mix_ups(good()) == []
    assert mix_ups(replace(good(), p1_mpa=None)) == []
    assert mix_ups(replace(good(), angle_deg=-good().angle_deg)) == [], "a rig may be built so"


def test_swapped_monitors_are_named() -> None:
    (said,) = mix_ups(swapped(good()))
    assert said.endswith("and the angle follows the command: p1 and p2 look swapped")
    with_set_points = replace(
        swapped(good()), p1_cmd_mpa=0.2 + good().dp_cmd_mpa / 2, p2_cmd_mpa=0.2 - good().dp_cmd_mpa / 2
    )
    assert "p1 and p2 look swapped; each follows the other's set-point" in mix_ups(with_set_points)[0]
    assert said in prepare(swapped(good()), MODEL).warnings


def test_a_command_of_the_other_sign_is_named() -> None:
    (said,) = mix_ups(replace(good(), dp_cmd_mpa=-good().dp_cmd_mpa))
    assert said.endswith("and so does the angle: dp_cmd_mpa has the other sign")


def test_without_an_angle_both_are_named() -> None:
    (said,) = mix_ups(replace(swapped(good()), angle_deg=None))
    assert said.endswith("p1 and p2 look swapped, or dp_cmd_mpa has the other sign")


@pytest.mark.parametrize(("factor", "unit"), [(1e3, "ms"), (1e6, "us"), (1e9, "ns")])
def test_time_in_another_unit_is_asked_about(factor: float, unit: str) -> None:
    record = replace(good(), t_s=good().t_s * factor)
    with pytest.raises(RecordError, match=f"is t_s in {unit}\\?"):
        prepare(record, MODEL, RecordOptions(resample=True))
    assert strange_clock(replace(good(), t_s=good().t_s * 99)) is None, "0.495 s a row"
    assert strange_clock(replace(good(), t_s=good().t_s * 101)) is not None, "0.505 s a row"


def test_pressures_that_move_under_a_command_that_stands_still_are_said() -> None:
    still = replace(good(), dp_cmd_mpa=np.full(len(good()), 0.1))
    (said,) = mix_ups(still)
    assert "dp_cmd_mpa stands still while the measured p1 - p2 moves" in said
    quiet = replace(still, p1_mpa=np.full(len(good()), 0.2), p2_mpa=np.full(len(good()), 0.2))
    assert mix_ups(quiet) == []
