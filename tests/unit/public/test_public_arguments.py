"""The public API under what a person may give it: places and records alike, and wrong arguments in one line."""

from dataclasses import replace

import numpy as np
import pamrig
import pytest

from rig.channels import Channel, Channels

MOTOR = Channels(Channel("set_point", "mm", (-50.0, 50.0)), Channel("position", "mm", (-50.0, 50.0)))
SWEEP = {"duration_s": 1.0, "settle_s": 0.1, "records": [{"sine": {"frequency_hz": 1.0, "amplitude_mpa": 0.1}}]}


def test_a_simulated_motor_speaks_of_its_own_channels_and_takes_no_other_rig_s_records() -> None:
    pneumatic = pamrig.load_model("simulated")
    motor = replace(pneumatic, channels=MOTOR)
    (said,) = pamrig.simulate(motor, SWEEP)
    assert said.channels == MOTOR
    assert "position_mm" in said.own_columns()
    assert np.array_equal(pamrig.simulate(motor, said)[0].angle_deg, said.angle_deg)
    for model, other in ((pneumatic, said), (motor, pamrig.simulate(pneumatic, SWEEP))):
        with pytest.raises(pamrig.RecordError, match="they are of different rigs"):
            pamrig.simulate(model, other)
