"""Counts, volts and curves: what goes out comes back, for every value and every register type."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.calibration import curve, inverse, loaded_ratio, wiper_position
from drivers.myrio.codec import BIPOLAR, UNIPOLAR, Converter, converter, decoder, encoder
from hil.emulators.nifpga.board import counts_of, output_volts

TERMINALS = st.sampled_from([UNIPOLAR, BIPOLAR])
DATATYPES = st.sampled_from(["U16", "I16"])
REGISTERS = st.sampled_from(["AO.A_0.VAL", "AO.B_1.VAL", "AO.C_0.VAL", "AO.C_1.VAL"])


@given(TERMINALS, DATATYPES, st.floats(-1e6, 1e6))
def test_a_voltage_comes_back_clamped_to_the_nearest_count(terminal: Converter, datatype: str, volts: float) -> None:
    bits = encoder(terminal, datatype, terminal.low_v, terminal.high_v)(volts)
    clamped = min(max(volts, terminal.low_v), terminal.high_v)
    assert abs(decoder(terminal, datatype)(bits) - clamped) <= terminal.lsb_v / 2 * (1 + 1e-9)


@given(TERMINALS, DATATYPES, st.floats(-20.0, 20.0))
def test_registers_hold_16_bits_of_their_type(terminal: Converter, datatype: str, volts: float) -> None:
    bits = encoder(terminal, datatype, terminal.low_v, terminal.high_v)(volts)
    assert 0 <= bits <= 0xFFFF if datatype == "U16" else -0x8000 <= bits <= 0x7FFF


@given(DATATYPES, st.floats(-30.0, 30.0), st.sampled_from([(0.0, 10.0), (1.0, 5.0), (0.0, 5.0)]))
def test_nothing_leaves_the_signal_not_even_by_rounding(datatype: str, volts: float, ends: tuple[float, float]) -> None:
    bits = encoder(BIPOLAR, datatype, *ends)(volts)
    assert ends[0] - 1e-6 <= decoder(BIPOLAR, datatype)(bits) <= ends[1] + 1e-6


@given(st.floats(4.0, 20.0))
def test_milliamperes_go_through_their_shunt(milliamperes: float) -> None:
    """250 Ohm: 4 mA a volt."""
    bits = encoder(UNIPOLAR, "U16", 4.0, 20.0, 4.0)(milliamperes)
    assert decoder(UNIPOLAR, "U16", 4.0)(bits) == pytest.approx(milliamperes, abs=4.01 * UNIPOLAR.lsb_v)


def test_minus_one_thousand_reads_as_64536() -> None:
    assert encoder(BIPOLAR, "U16", -10.0, 10.0)(-1000 * BIPOLAR.lsb_v) == 64536
    assert decoder(BIPOLAR, "U16")(64536) == pytest.approx(-1000 * BIPOLAR.lsb_v)


@given(REGISTERS, st.floats(-12.0, 12.0))
def test_driver_and_terminals_agree_on_every_voltage(register: str, volts: float) -> None:
    """The emulator works its counts out by itself; both must mean the same voltage within a count."""
    terminal = converter(register, output=True)
    ours = encoder(terminal, "U16", terminal.low_v, terminal.high_v)(volts)
    theirs = decoder(terminal, "U16")(counts_of(register, volts))
    assert decoder(terminal, "U16")(ours) == pytest.approx(theirs, abs=1.001 * terminal.lsb_v)
    assert output_volts(register, ours) == pytest.approx(decoder(terminal, "U16")(ours), abs=2e-6)


@pytest.mark.parametrize("datatype", ["U32", "I8", "Bool", "Fxp"])
def test_other_types_of_register_are_refused(datatype: str) -> None:
    for make in (lambda: decoder(UNIPOLAR, datatype), lambda: encoder(UNIPOLAR, datatype, 0.0, 5.0)):
        with pytest.raises(ValueError, match="expected U16 or I16"):
            make()


@pytest.mark.parametrize("name", ["AO.A_2.VAL", "AI.A_4.VAL", "AI.C_2.VAL", "AI.D_0.VAL", "AO.SYS.GO", "AI.A_0", ""])
@pytest.mark.parametrize("output", [True, False])
def test_other_names_are_no_terminals(name: str, output: bool) -> None:
    with pytest.raises(ValueError, match="not an analog"):
        converter(name, output)


@st.composite
def knots(draw: st.DrawFn) -> list[tuple[float, float]]:
    steps = draw(st.lists(st.tuples(st.floats(0.01, 10.0), st.floats(0.01, 10.0)), min_size=1, max_size=8))
    raw, value, sign = draw(st.floats(-50, 50)), draw(st.floats(-50, 50)), draw(st.sampled_from([1, -1]))
    found = [(raw, value)]
    for right, up in steps:
        raw, value = raw + right, value + sign * up
        found.append((raw, value))
    return found


@given(knots(), st.floats(-100.0, 100.0))
def test_a_curve_and_its_inverse_undo_each_other(found: list[tuple[float, float]], raw: float) -> None:
    assert inverse(found)(curve(found)(raw)) == pytest.approx(raw, rel=1e-6, abs=1e-6)


@given(knots())
def test_a_curve_passes_through_its_knots(found: list[tuple[float, float]]) -> None:
    assert [curve(found)(raw) for raw, _ in found] == pytest.approx([value for _, value in found], rel=1e-9, abs=1e-9)


@given(st.floats(0.0, 1.0), st.floats(0.0, 5.0))
def test_the_load_correction_inverts_the_divider(position: float, load: float) -> None:
    assert wiper_position(loaded_ratio(position, load), load) == pytest.approx(position, abs=1e-9)
