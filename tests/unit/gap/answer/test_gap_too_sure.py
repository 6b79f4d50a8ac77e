"""What cannot be judged is not denied: coarse records, and a library from which effects were taken."""

import pytest
from support.plants.gap_rigs import baselines, model, names, session

from rig.gap import diagnose
from rig.model.parameters import AddedEffect
from rig.record import Record

SLOW = AddedEffect("valve_lag", {"tau_s": 0.04})


def thinned(records: list[Record], every: int) -> list[Record]:
    return [record.rows(slice(None, None, every)) for record in records]


@pytest.mark.parametrize("every", [4, 10])
def test_a_healthy_rig_in_coarse_records_is_no_finding(every: int) -> None:
    found = diagnose(model(), thinned(session(303), every))
    assert found.verdict == "none"
    assert any("when commands were written is not known" in note for note in found.notes)


def test_records_at_the_simulators_own_step_say_nothing_of_that() -> None:
    assert not any("when commands" in note for note in diagnose(model(), session(303)).notes)


def test_slow_regulators_are_found_in_coarse_records_all_the_same() -> None:
    assert names(diagnose(model(), thinned(session(301, SLOW), 4))) == {"valve_lag"}


@pytest.mark.parametrize("library", [[], ["sensor_noise"], ["end_stop"]])
def test_without_its_effects_in_the_library_a_gap_is_unknown(library: list[str]) -> None:
    day = [list(baselines()[0])]
    found = diagnose(model(), session(301, SLOW), day, library=library)
    assert found.verdict == "unknown"
    assert diagnose(model(), session(303), day, library=library).verdict == "none"


def test_an_unknown_has_the_probability_that_something_is_there() -> None:
    found = diagnose(model(), thinned(session(302, AddedEffect("coulomb_friction", {"width_deg": 2.0})), 10))
    assert found.causes
    assert all(cause.confidence > 0.3 for cause in found.causes)
    assert 0.0 < found.confidence <= min(cause.confidence for cause in found.causes)
