"""What results print as where there is no notebook, and that what was identified is taken for its model."""

import numpy as np
import pamrig
import pytest
from pamrig._picture import Table

SWEEP = {"duration_s": 2.0, "settle_s": 0.5, "records": [{"sine": {"frequency_hz": 1.0, "amplitude_mpa": 0.1}}]}


def test_a_table_is_the_same_as_text_and_as_html() -> None:
    table = Table(("record", "off"), [("long name", 1), ("b", 22)], "a < b")
    assert table.to_text() == "a < b\nrecord     off\nlong name  1\nb          22"
    assert table.to_html().startswith("<p><b>a &lt; b</b></p><table>")
    assert Table(("", ""), [("Answer:", "none")]).to_text() == "Answer:  none"
    assert Table(("record",), []).to_text() == "record"


def test_what_was_identified_is_taken_for_its_model_and_prints() -> None:
    records = pamrig.simulate("simulated", SWEEP)
    found = pamrig.identify(records, seeds=1, iterations=5, particles=10, bounded=False)
    assert repr(found).splitlines()[0] == f"RMSE {found.rmse_deg:.3g} deg"
    judged = pamrig.validate(found, records)
    assert judged.scores[0].rmse_deg == pamrig.validate(found.model, records).scores[0].rmse_deg
    assert records[0].name in repr(judged)
    (said,), (again,) = pamrig.simulate(found, records), pamrig.simulate(found.model, records)
    assert np.array_equal(said.angle_deg, again.angle_deg)
    with pytest.raises(pamrig.ModelError, match="load_model reads one"):
        pamrig.save_model(3, "x.yaml")  # type: ignore[arg-type]


def test_a_diagnosis_prints_its_answer() -> None:
    records = pamrig.simulate("simulated", SWEEP | {"duration_s": 3.0})
    assert repr(pamrig.diagnose("simulated", records, effects=["delay"])).startswith("Answer:")


def test_a_record_and_a_rig_print_as_one_line() -> None:
    (record,) = pamrig.simulate("simulated", SWEEP)
    assert repr(record).startswith(f"Record({record.name}: {len(record)} rows, every 5 ms: t_s, dp_cmd_mpa, ")
    assert repr(record.rows(slice(0, 1))).startswith(f"Record({record.name}: 1 row: ")
    rig = pamrig.simulated_rig({"delay": {"delay_s": 0.02}}, seed=3)
    assert repr(rig) == "Rig(simulated, 5 ms, simulated, seed 3, with delay)"
    assert repr(pamrig.load_rig("paper_myrio")) == "Rig(paper, myRIO, 5 ms, real)"
