"""The serial valves' dialect and the physics of their wire: bytes in, bytes out, milliseconds worked out by hand."""

import pytest

from drivers.itv_serial.codec import Codec, Dialect, ReplyError, pace
from rig.config import structure
from rig.errors import ConfigError


def test_the_default_dialect_is_the_one_that_is_known() -> None:
    codec = Codec(Dialect())
    assert codec.set(511) == b"SET 511\r\n"
    assert codec.monitor == b"MON\r\n"
    codec.check_set(b"511", 511)
    assert codec.monitored(b"0409") == 409


def test_every_part_of_the_dialect_is_a_setting() -> None:
    codec = Codec(
        Dialect("P={count:04d}", "P?", "\r", "\n", "ACK", r"P=(?P<count>\d+)kPa", ["NAK"], full_scale_counts=9999)
    )
    assert codec.set(42) == b"P=0042\r"
    assert codec.monitor == b"P?\r"
    codec.check_set(b"ACK", 42)
    assert codec.monitored(b"P=123kPa") == 123
    with pytest.raises(ReplyError, match="refused: 'NAK 3'"):
        codec.check_set(b"NAK 3", 42)


@pytest.mark.parametrize(
    ("reply", "says"),
    [
        (b"512", "answered 512 to a set-point of 511"),
        (b"UNKNOWN COMMAND", "refused"),
        (b"OUT OF RANGE", "refused"),
        (b"51x", "unexpected reply"),
        (b"\xff\x8051", "garbled.*baud"),
        (b"", "unexpected reply ''"),
    ],
)
def test_what_does_not_confirm_the_set_point_is_said(reply: bytes, says: str) -> None:
    with pytest.raises(ReplyError, match=says):
        Codec(Dialect()).check_set(reply, 511)


@pytest.mark.parametrize("reply", [b"51.2", b"n/a", b""])
def test_a_pattern_of_one_s_own_that_lets_other_than_counts_through_is_said(reply: bytes) -> None:
    """It ended the process that drives the line, by a traceback."""
    codec = Codec(Dialect(set_reply="(?P<count>.*)", monitor_reply="(?P<count>.*)"))
    for look in (codec.monitored, lambda said: codec.check_set(said, 51)):
        with pytest.raises(ReplyError, match="where counts are expected: does the dialect's pattern fit"):
            look(reply)


def test_a_monitor_above_full_scale_is_no_pressure() -> None:
    with pytest.raises(ReplyError, match="9999, above the full scale of 1023"):
        Codec(Dialect()).monitored(b"9999")


@pytest.mark.parametrize(("number", "count"), [(-5.0, 0), (0.4, 0), (511.6, 512), (1023.4, 1023), (1e9, 1023)])
def test_set_points_are_rounded_and_kept_in_range(number: float, count: int) -> None:
    assert Codec(Dialect()).to_count(number) == count


@pytest.mark.parametrize("number", [float("nan"), float("inf")])
def test_a_set_point_that_is_not_finite_has_no_bytes(number: float) -> None:
    with pytest.raises(ValueError, match="cannot be sent"):
        Codec(Dialect()).to_count(number)


def test_the_wire_at_9600_baud() -> None:
    """SET 1023 CR LF and 1023 CR LF are 16 bytes of 10 bits: 16.7 ms; MON CR LF and its answer 11: 11.5 ms."""
    found = pace(Dialect(), 9600, 10, monitor=True)
    assert found.set_s == pytest.approx(16 * 10 / 9600)
    assert found.monitor_s == pytest.approx(11 * 10 / 9600)
    assert found.rate_hz == pytest.approx(9600 / 270)
    assert "35.6 set-points/s reach the valve, one of 5.6 ticks" in found.summary(9600, 0.005)


def test_the_wire_is_slower_with_echo_parity_and_turnaround_and_faster_without_answers() -> None:
    plain = pace(Dialect(), 57600, 10, monitor=False)
    assert plain.monitor_s == 0.0
    assert "every tick" in plain.summary(57600, 0.005)
    assert pace(Dialect(), 57600, 11, monitor=False).set_s == pytest.approx(1.1 * plain.set_s)
    assert pace(Dialect(turnaround_s=0.01), 57600, 10, monitor=False).set_s == pytest.approx(plain.set_s + 0.01)
    assert pace(Dialect(echo=True), 57600, 10, monitor=False).set_s == pytest.approx(plain.set_s + 100 / 57600)
    assert pace(Dialect(set_reply=""), 57600, 10, monitor=False).set_s == pytest.approx(100 / 57600)


@pytest.mark.parametrize(
    ("raw", "says"),
    [
        ({"set_command": "SET"}, r"set_command must contain \{count\}"),
        ({"monitor_reply": r"\d+"}, "needs a group"),
        ({"set_reply": "("}, "not a regular expression"),
        ({"terminator": ""}, "terminator must be ASCII text"),
        ({"full_scale_counts": 0}, "outside"),
        ({"monitor_comand": "MON"}, "did you mean 'monitor_command'"),
    ],
)
def test_a_broken_dialect_is_one_line(raw: dict[str, object], says: str) -> None:
    with pytest.raises(ConfigError, match=says) as caught:
        structure(raw, Dialect, "rig.yaml: devices.valves.dialect")
    assert "\n" not in str(caught.value)
