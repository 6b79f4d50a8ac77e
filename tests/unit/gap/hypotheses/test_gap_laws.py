"""What a law's numbers may be."""

import pytest

from rig.gap.hypotheses.library import Law, chosen
from rig.model.effect_stages import EFFECT_STAGES

LAWS = [law for effect in chosen(None) for law in effect.laws]
SCALES = {
    "one": 1.0,
    "span_deg": 20.0,
    "high_deg": 20.0,
    "low_deg": -20.0,
    "top_mpa": 0.3,
    "swing_mpa": 0.2,
    "rate_mpa_s": 1.0,
    "regulator_s": 0.04,
    "filling_mpa_s": 0.2,
}


@pytest.mark.parametrize("law", LAWS, ids=lambda law: f"{law.stage}-{'-'.join(law.free)}")
def test_no_number_goes_beyond_its_stage_and_a_size_of_the_grid_lies_within(law: Law) -> None:
    known = {number.name: number for number in EFFECT_STAGES[law.stage].numbers}
    for name in law.free:
        low, high = law.range_of(name, SCALES)
        assert known[name].low <= low < high <= known[name].high
    low, high = law.range_of(law.free[0], SCALES)
    assert any(low <= sign * size * SCALES[law.scale] <= high for sign in law.signs for size in law.grid)


def test_shapes_that_count_in_a_scale_are_in_their_own_unit() -> None:
    law = next(law for law in LAWS if law.counted)
    for shape, asked in zip(law.shapes_in(SCALES), law.shapes, strict=True):
        assert shape["supply_mpa"] == pytest.approx(asked["supply_mpa"] * SCALES["top_mpa"])
        assert {name: value for name, value in shape.items() if name not in law.counted} == {
            name: value for name, value in asked.items() if name not in law.counted
        }


LIMITS = [law for law in LAWS if "integral_s" in EFFECT_STAGES[law.stage].neutral()]


@pytest.mark.parametrize("law", LIMITS, ids=lambda law: f"{law.stage}-{'-'.join(law.free)}")
@pytest.mark.parametrize("integral_s", [0.0, 0.6])
def test_a_law_is_told_by_whether_its_regulators_integrate(law: Law, integral_s: float) -> None:
    """Laws of regulators that integrate stand beside the same ones of such as do not."""
    numbers = EFFECT_STAGES[law.stage].neutral() | {"tau0_s": 0.04} | law.shapes[0] | {"integral_s": integral_s}
    assert (law.agrees(numbers) >= 0) == ("integral_s" in law.free or integral_s == 0.0)


@pytest.mark.parametrize("regulator_s", [0.003, 0.04, 0.2])
def test_a_regulator_is_quicker_by_its_own_time_constant_at_most(regulator_s: float) -> None:
    (law,) = [law for law in LAWS if law.stage == "valve_lag" and max(law.grid) < 0.0]
    scales = SCALES | {"regulator_s": regulator_s}
    assert law.range_of("tau_s", scales) == pytest.approx((-regulator_s, 0.0))
    assert all(-regulator_s < size * scales[law.scale] < 0.0 for size in law.grid)
