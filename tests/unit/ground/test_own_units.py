"""What leaves the program in a rig's own names and units: sentences, heads of tables, plain data."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.channels import PNEUMATIC, Channel, Channels
from rig.own_units import own_label, own_plain, own_text

MOTOR = Channels(Channel("set_point", "mm", (-50.0, 50.0)), Channel("position", "mm", (-100.0, 100.0)))
"""1 MPa is 250 mm of the set-point, 1 deg is 5 mm of the position."""


@pytest.mark.parametrize(
    ("told", "own"),
    [
        ("falls from 3.7 to 0.2 deg (0.1 to 0.3), on records", "falls from 18 to 1 mm (0.5 to 2), on records"),
        ("the angle is 0.50 deg (0.40 to 0.60 deg) off", "the position is 2.5 mm (2.0 to 3.0 mm) off"),
        ("0.3 (0.2 to 0.4) deg", "2 (1 to 2) mm"),
        ("it sags by 5 kPa, at least 0.005 MPa", "it sags by 1 mm, at least 1 mm"),
        ("sensor_offset +1.2 deg a minute", "sensor_offset +6.0 mm a minute"),
        ("p1 - p2 commanded [MPa]", "set point commanded [mm]"),
        ("RMSE deg", "RMSE mm"),
        ("0.5 deg (70 to 80 %)", "2 mm (70 to 80 %)"),
        ("angle_deg, my_angle.csv and a/angle/deg.csv stay", "angle_deg, my_angle.csv and a/angle/deg.csv stay"),
        ("-0.0 deg", "-0 mm"),
        ("a record of 12 s at 4 Hz", "a record of 12 s at 4 Hz"),
    ],
)  # fmt: skip
def test_sentences(told: str, own: str) -> None:
    assert own_text(told, MOTOR) == own


SLIDE = Channels(Channel("command", "V", (0.0, 10.0)), Channel("position", "mm", (0.0, 300.0)))
"""0 deg is 150 mm, 1 deg is 7.5 mm, 0 MPa is 5 V."""


@pytest.mark.parametrize(
    ("told", "own"),
    [
        ("a stop where it reads -10 deg; 2.0 deg off", "a stop where it reads 75 mm; 15 mm off"),
        ("where it reads 12.5 deg (12.0 to 13.0)", "where it reads 243.8 mm (240.0 to 247.5)"),
        ("a rail that reads 0 deg", "a rail that reads 150 mm"),
        ("the farthest reads -36.9 deg", "the farthest reads -127 mm"),
        ("the valve reads 0.10 MPa, 0.10 MPa less", "the valve reads 7.5 V, 2.5 V less"),
    ],
)
def test_what_a_channel_reads_counts_from_its_own_zero(told: str, own: str) -> None:
    assert own_text(told, SLIDE) == own
    assert own_text(told, PNEUMATIC) == told


def test_places_on_the_scale_count_from_its_own_zero() -> None:
    stop = {"value": -10.0, "low": -12.0, "high": -8.0, "unit": "deg"}
    plain = {"parameters": {"low_deg": stop, "width_deg": stop}, "region": [{"angle": "-20.0 to -10.0 deg"}]}
    assert own_plain(plain, SLIDE) == {
        "parameters": {
            "low_mm": {"value": 75.0, "low": 60.0, "high": 90.0, "unit": "mm"},
            "width_mm": {"value": -75.0, "low": -90.0, "high": -60.0, "unit": "mm"},
        },
        "region": [{"angle": "0 to 75.0 mm"}],
    }
    assert own_plain(plain, PNEUMATIC) == plain


def test_an_excitation_is_called_by_its_amplitude_in_mm() -> None:
    assert own_label("sine_0.5hz_0.20mpa_r2", MOTOR) == "sine_0.5hz_50mm_r2"
    assert own_label("chirp_0.1-4hz_20s_0.08mpa", MOTOR) == "chirp_0.1-4hz_20s_20mm"
    assert own_label("sine_0.5hz_0.20mpa", PNEUMATIC) == "sine_0.5hz_0.20mpa"


@given(st.floats(-1e3, 1e3).filter(lambda value: abs(value) > 1e-3), st.integers(1, 5))
def test_a_number_keeps_its_digits_and_its_size(value: float, digits: int) -> None:
    told = f"{float(f'{value:.{digits - 1}e}'):g}"
    back = float(own_text(f"by {told} deg", MOTOR).split()[1])
    assert back == pytest.approx(5.0 * float(told), rel=0.5)
    assert back == 0.0 or back * value > 0.0


def test_plain_data_change_with_their_keys_and_units() -> None:
    plain = {
        "rms_deg": 2.0,
        "gap": [{"floor_deg": 1.0, "after_low_deg": None, "ratio": 3.0}],
        "rate_deg_min": {"value": 1.0, "low": 0.5, "high": 2.0, "unit": "deg/min"},
        "moved": {"from": 0.01, "to": 0.02, "unit": "MPa", "name": "offset"},
        "added_to_model": {"parameters": {"width_deg": 1.0}},
        "note": "0.4 deg off",
        "std": 3.0,
    }
    assert own_plain(plain, MOTOR) == {
        "rms_mm": 10.0,
        "gap": [{"floor_mm": 5.0, "after_low_mm": None, "ratio": 3.0}],
        "rate_mm_min": {"value": 5.0, "low": 2.5, "high": 10.0, "unit": "mm/min"},
        "moved": {"from": 2.5, "to": 5.0, "unit": "mm", "name": "offset"},
        "added_to_model": {"parameters": {"width_deg": 1.0}},
        "note": "2 mm off",
        "std": 3.0,
    }


@given(st.text())
def test_a_pneumatic_rig_is_told_as_it_is(text: str) -> None:
    assert own_text(text, PNEUMATIC) == text
    assert own_plain({"rms_deg": 1.0, "text": text}, PNEUMATIC) == {"rms_deg": 1.0, "text": text}
