"""The page about the JSON of a diagnosis names every key of it."""

from collections.abc import Iterator
from typing import Any

from conftest import ROOT

from rig.gap.answer.facts import (
    Band,
    Evidence,
    Gap,
    Judged,
    Link,
    OverFrequency,
    OverTime,
    ParameterMove,
    RecordGap,
    Retuning,
    Verdict,
    Where,
)
from rig.gap.answer.result import Cause, Diagnosis, Interval, Observation, Ranked
from rig.gap.raw_tests.signature import Signature
from rig.gap.records.partners import Match
from rig.gap.response.causes import Applied

PAGE = (ROOT / "docs" / "reference" / "diagnosis_json.md").read_text(encoding="utf-8")
BY_NAME = ("parameters", "probability", "shares", "stage_probability", "factors", "sizes")
"""Keys whose mappings are keyed by names of effects, numbers, stages and factors."""


_BAND = Band("rising", 1.0, 1.0, 0.5)
WHERE = Where(
    "timing",
    {"valve": 1.0, "downstream": 0.0},
    [Link("timing", ("delay",), 1.0)],
    [OverFrequency("sine", 0.5, 1.0, {"excited": 1.0})],
    [_BAND],
    [_BAND],
    [OverTime("sine", 1.0, 1.0, 0.0, None)],
)


def full() -> Diagnosis:
    """One with something in every place but the plan's."""
    number = {"delay_s": Interval(0.01, 0.009, 0.011, "s")}
    lag = Cause("delay", "timing", "pressures", Applied("delay", {"delay_s": 0.01}), number, 1.0, 0.1, 0.9, (), 0.9)
    evidence = Evidence(
        {"angle": Judged(1.0, 0.1, "deg", True, {"delay": 0.9}, ["delay"], 0.0, {"timing": 0.9})},
        [Signature("noise", "sensor_noise", False, 0.1, 0.1, "deg", "no more noise")],
        [RecordGap("sine", 1.0, 0.1)],
        pairing=[Match("sine", 1, "sine", "name", 0.0, 0.1, 0.0)],
    )
    return Diagnosis(
        Verdict.EXPLAINED,
        0.9,
        Gap(1.0, 0.1, 10.0, 0.99, 0.1, 0.1, 0.2, "sessions", 1.0),
        WHERE,
        [lag],
        [Ranked("delay", "timing", "pressures", 0.9, 0.9, 1.0)],
        evidence=evidence,
        retuning=Retuning(1.0, 0.5, (ParameterMove("valve1_tau_s", 0.04, 0.05, 0.04, 0.06, "s"),)),
        observations=[Observation("noise", None, "more noise", number, 0.9, 0.0)],
    )


def keys(plain: Any, under: str = "") -> Iterator[str]:
    """Every key of the format; names of effects and numbers are none."""
    if isinstance(plain, dict):
        for name, inside in plain.items():
            by_name = under in BY_NAME
            yield from () if by_name else (name,)
            yield from keys(inside, "" if by_name else name)
    elif isinstance(plain, list):
        for inside in plain:
            yield from keys(inside)


def test_every_key_is_on_the_page() -> None:
    said = set(keys(full().to_json()))
    assert {"verdict", "ambiguous_with", "looks_like", "minus_log_evidence_nats", "unknown_beside"} <= said
    assert sorted(key for key in said if f"`{key}`" not in PAGE) == []


def test_every_verdict_is_on_the_page() -> None:
    assert [verdict for verdict in Verdict if f"`{verdict.value}`" not in PAGE] == []
