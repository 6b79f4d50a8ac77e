"""The control protocol as text: what is a request, what is refused and how, and that any line gets exactly one
answer."""

import contextlib
import json
import math
import os

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.service.connections import protocol
from rig.service.connections.protocol import COMMANDS, Code, Refused


def request(**fields: object) -> dict[str, object]:
    return {"v": 1, "id": 1, "command": "status"} | fields


def test_a_request_is_a_command_with_its_arguments() -> None:
    parsed = protocol.parse(request(command="start", sweeps=["/a.yaml"], pause_s=1))
    assert (parsed.id, parsed.command, parsed.arguments) == (1, "start", {"sweeps": ["/a.yaml"], "pause_s": 1})


@pytest.mark.parametrize(
    ("message", "code", "text"),
    [
        (request(v=2), Code.WRONG_VERSION, "version 2 is not spoken here; this is version 1"),
        ({"command": "status"}, Code.WRONG_VERSION, "version nothing is not spoken here"),
        (request(command="statsu"), Code.UNKNOWN_COMMAND, "unknown command 'statsu'; did you mean 'status'?"),
        (request(command=["arm"]), Code.UNKNOWN_COMMAND, "unknown command a list"),
        (request(speed=3), Code.BAD_ARGUMENT, "status: unknown argument 'speed'; it takes none"),
        (request(command="stop", after_curent=True), Code.BAD_ARGUMENT, "did you mean 'after_current'?"),
        (request(command="stop", after_current=1), Code.BAD_ARGUMENT, "stop: after_current: 1"),
        (request(command="start", pause_s=True), Code.BAD_ARGUMENT, "start: pause_s: True"),
        (request(command="start", sweeps="a"), Code.BAD_ARGUMENT, "start: sweeps: 'a'"),
        (
            request(command="start", pause_s=10**400),
            Code.BAD_ARGUMENT,
            "start: pause_s: a number of more than 20 digits is not",
        ),
        (
            request(command="subscribe", rate_hz=-(10**400)),
            Code.BAD_ARGUMENT,
            "subscribe: rate_hz: a number of more than 20",
        ),
        (
            request(command="start", pause_s=math.nan),
            Code.BAD_ARGUMENT,
            "start: pause_s: nan is not a number that can be",
        ),
        (
            request(command="start", sweeps=["/a\0b"]),
            Code.BAD_ARGUMENT,
            "'/a\\x00b' holds a character 0, which no text has",
        ),
        (
            request(command="start", sweeps=["/a\ud800"]),
            Code.BAD_ARGUMENT,
            "'/a\\ud800' is no UTF-8 text",
        ),
        (
            request(command="start", sweeps=[os.fsdecode(b"/a\xff.yaml")]),
            Code.BAD_ARGUMENT,
            "'/a\\udcff.yaml' is no UTF-8 text, and the daemon takes no other, for paths neither: rename the file",
        ),
        (request(command="\ud800"), Code.UNKNOWN_COMMAND, "unknown command '\\ud800'"),
        (request(v=10**400), Code.WRONG_VERSION, "version a number of more than 20 digits"),
        (request(command="x" * 60_000), Code.UNKNOWN_COMMAND, "xxx...; "),
    ],
)
def test_what_is_no_request_is_refused_with_a_code_and_one_line(
    message: dict[str, object], code: Code, text: str
) -> None:
    with pytest.raises(Refused) as caught:
        protocol.parse(message)
    assert caught.value.code is code
    assert text in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("line", [b"", b"nonsense", b"[1]", b'"arm"', b"\xff\xfe", b"[" * 100_000])
def test_a_line_that_is_no_mapping_is_refused(line: bytes) -> None:
    with pytest.raises(Refused) as caught:
        protocol.decode(line)
    assert caught.value.code is Code.BAD_REQUEST


@given(
    st.dictionaries(
        st.text(max_size=8), st.recursive(st.none() | st.booleans() | st.floats() | st.text(), st.lists, max_leaves=5)
    )
)
def test_no_mapping_gets_past_parse_by_anything_but_a_request_or_a_refusal(message: dict[str, object]) -> None:
    with contextlib.suppress(Refused):
        assert protocol.parse({"v": 1} | message).command in COMMANDS


@pytest.mark.parametrize(("given_id", "kept"), [(7, 7), ("a", "a"), (True, None), ([1], None), (None, None)])
def test_the_answer_repeats_a_usable_id(given_id: object, kept: object) -> None:
    assert protocol.request_id({"id": given_id}) == kept


def test_numbers_that_json_lacks_become_null() -> None:
    line = protocol.answer(1, {"a": math.nan, "b": [math.inf, 1.5], "c": "NaN"})
    assert line.endswith(b"\n")
    assert json.loads(line)["result"] == {"a": None, "b": [None, 1.5], "c": "NaN"}


def test_only_looking_is_for_viewers() -> None:
    assert {name for name, command in COMMANDS.items() if command.looking} == {"status", "subscribe"}
