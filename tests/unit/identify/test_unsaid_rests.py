"""Records around several P0s that do not say them: each is taken to be commanded around its own."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rig.conditions import MEASURED_REST, conditions
from rig.identify.records.rest import at_own_rest
from rig.identify.response.valves import identify_valves
from rig.identify.search.stability import SweepRange
from rig.identify.validate import validate
from rig.model.parameters import load_model
from rig.model.simulation import simulate
from rig.record import Record

RIG = load_model(Path(__file__).parents[3] / "configs" / "models" / "simulated.yaml")
ROWS = 2000


def measured(rest_mpa: float, hz: float = 0.5) -> Record:
    """As somebody's table has it: a difference of set-points, both pressures, the angle, and no word of P0."""
    t = np.arange(ROWS) * 0.005
    dp = 0.2 * np.sin(2 * np.pi * hz * t)
    record = Record(f"at_{rest_mpa:g}", t, dp, p1_cmd_mpa=rest_mpa + dp / 2, p2_cmd_mpa=rest_mpa - dp / 2)
    clean, noise = simulate(RIG, record), np.random.default_rng(int(1000 * rest_mpa))
    sizes = {"p1_mpa": 4e-4, "p2_mpa": 4e-4, "angle_deg": 0.03}
    columns = {key: getattr(clean, key) + noise.normal(0.0, size, ROWS) for key, size in sizes.items()}
    return replace(clean, p1_cmd_mpa=None, p2_cmd_mpa=None, **columns)


SEVERAL = [measured(0.2), measured(0.15, 0.8), measured(0.25, 0.3)]


def test_each_is_taken_for_its_own_and_that_is_said() -> None:
    taken, said = at_own_rest(SEVERAL)
    assert [record.facts[MEASURED_REST] for record in taken] == pytest.approx([0.2, 0.15, 0.25])
    assert said.startswith("P0 stands in no record and is read from the measured pressures: 0.15, 0.20 and 0.25 MPa;")
    assert all("p0_mpa" not in conditions(record) for record in taken), "it was commanded, or both are shifted"


def test_one_rest_and_rests_that_are_said_stay_as_they_are() -> None:
    for records in (
        [measured(0.2), measured(0.21)],
        [replace(record, facts={"p0_mpa": 0.2}) for record in SEVERAL],
        [replace(record, p1_mpa=None) for record in SEVERAL],
    ):
        taken, said = at_own_rest(records)
        assert said == ""
        assert all(one is other for one, other in zip(taken, records, strict=True))


@pytest.mark.parametrize("says", [True, False])
def test_the_regulators_are_found_from_records_around_several_rests(says: bool) -> None:
    """All about the first one's P0: 40 kPa off, with limits and gains that no valve has."""
    said = [replace(record, facts={"p0_mpa": float(record.name[3:])}) for record in SEVERAL]
    found = identify_valves(said if says else at_own_rest(SEVERAL)[0], 0.005, 0.2)
    assert max(found.rmse_mpa) < 1e-3


def test_the_whole_chain_is_validated_around_each_rest() -> None:
    found = validate(RIG, SEVERAL, SweepRange(0.2, 0.8, 0.2))
    assert [score.command_rmse_deg for score in found.scores] == pytest.approx([0.0] * 3, abs=0.3)
    assert any(text.startswith("P0 stands in no record") for text in found.warnings)
