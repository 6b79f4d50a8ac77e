"""The records that a fingerprint keeps come back as they were, as far as anybody looks; another text is refused."""

import base64
import lzma
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.conditions import conditions
from rig.errors import ModelError
from rig.model.response.kept_day import KEPT_PERIOD_S, MOST_S, packed, unpacked
from rig.record import Record

PERIOD_S = 0.005
COLUMNS = ("dp_cmd_mpa", "p1_cmd_mpa", "p2_cmd_mpa", "p1_mpa", "p2_mpa", "angle_deg")


def record(name: str = "sine", seed: int = 1, rows: int = 1200, hz: float = 0.5, noise: float = 1.0) -> Record:
    """A sine as the rig answers it, with the noise of its sensors."""
    t, draw = PERIOD_S * np.arange(rows), np.random.default_rng(seed)
    dp = 0.2 * np.sin(2.0 * np.pi * hz * t)
    p1, p2 = (0.2 + sign * 0.5 * dp + noise * 4e-4 * draw.standard_normal(rows) for sign in (1.0, -1.0))
    angle = 5.0 + 90.0 * dp + noise * 0.03 * draw.standard_normal(rows)
    return Record(name, t, dp, angle, 0.2 + 0.5 * dp, 0.2 - 0.5 * dp, p1, p2, facts={"p0_mpa": 0.2, "load_kg": 1.5})


@given(
    seed=st.integers(0, 1000),
    rows=st.integers(400, 3000),
    hz=st.floats(0.05, 4.0),
    apart=st.sampled_from([1, 2, 4, 8]),
    both=st.booleans(),
)
def test_a_record_comes_back(seed: int, rows: int, hz: float, apart: int, both: bool) -> None:
    made = record(seed=seed, rows=rows, hz=hz, noise=0.0).rows(np.arange(0, rows, apart))
    if not both:
        made = replace(made, p1_cmd_mpa=None, p2_cmd_mpa=None, p1_mpa=None)
    (back,) = unpacked(packed([made]))
    assert back.name == made.name
    assert conditions(back) == pytest.approx(conditions(made), abs=1e-5)
    assert back.t_s == pytest.approx(made.t_s)
    inner = slice(40, -40) if len(made) > 100 else slice(20, -20)
    for name in COLUMNS:
        mine, theirs = getattr(made, name), getattr(back, name)
        assert (mine is None) == (theirs is None)
        if mine is not None:
            assert len(mine) == len(theirs)
            assert theirs[inner] == pytest.approx(
                mine[inner], abs=0.004 * np.ptp(mine) + 0.03 * np.ptp(mine) * (hz > 2.0)
            )
    assert back.dp_cmd_mpa == pytest.approx(made.dp_cmd_mpa, abs=1e-4 * np.ptp(made.dp_cmd_mpa))


def test_noise_is_not_kept_and_what_is_slow_stays() -> None:
    made, clean = record(rows=6000), record(rows=6000, noise=0.0)
    (back,) = unpacked(packed([made]))
    assert back.angle_deg is not None
    assert made.angle_deg is not None
    assert clean.angle_deg is not None
    left, there = np.std(back.angle_deg - clean.angle_deg), np.std(made.angle_deg - clean.angle_deg)
    assert left == pytest.approx(there * np.sqrt(PERIOD_S / KEPT_PERIOD_S), rel=0.15)


def test_a_session_is_a_few_kilobytes() -> None:
    session = [record(f"sine_{k}", seed=k, rows=4000, hz=0.1 + 0.2 * k) for k in range(7)]
    assert len(packed(session)) < 30_000


def test_conditions_in_columns_and_words_come_back() -> None:
    made = record()
    tagged = replace(
        made,
        facts={"tags": {"temperature_c": 21.5, "load": "weights"}, "host": "lab"},
        extra={"tension_n": np.full(len(made), 40.0), "lateness_us": np.zeros(len(made))},
    )
    (back,) = unpacked(packed([tagged]))
    said = {"temperature_c": 21.5, "load": "weights", "tension_n": 40.0, "p0_mpa": 0.2}
    assert conditions(tagged) == said
    assert {name: said if isinstance(said, str) else round(said, 4) for name, said in conditions(back).items()} == said
    assert "host" not in back.facts
    assert set(back.extra) == {"tension_n"}


def test_of_one_name_and_condition_the_last_is_kept_and_only_whole_ones() -> None:
    first, last = record(seed=1), record(seed=2)
    loaded = replace(record(seed=3), facts={"load_kg": 3.0})
    holed = replace(record("holed"), angle_deg=np.where(np.arange(1200) == 7, np.nan, 0.0))
    blind = replace(record("blind"), angle_deg=None)
    kept = unpacked(packed([first, last, loaded, holed, blind]))
    assert [(each.name, each.facts["load_kg"]) for each in kept] == [("sine", 1.5), ("sine", 3.0)]
    (alone,) = unpacked(packed([last]))
    assert np.array_equal(kept[0].angle_deg, alone.angle_deg)


def test_no_more_is_kept_than_there_is_room() -> None:
    rows = int(0.4 * MOST_S / PERIOD_S)
    many = [record(f"sine_{k}", rows=rows) for k in range(4)]
    assert [each.name for each in unpacked(packed(many))] == ["sine_0", "sine_1"]
    assert packed([]) == ""
    assert unpacked("") == []


def sealed(body: bytes) -> str:
    return base64.b64encode(lzma.compress(body)).decode()


@pytest.mark.parametrize(
    "text",
    [
        "no base64 at all!",
        base64.b64encode(b"not packed").decode(),
        sealed(b"[]]\n"),
        sealed(b'[{"name": 3}]\n'),
        sealed(b"[7]\n"),
        sealed(b'[{"rows": 9, "apart": 0, "period_s": 0.005, "steps": {"dp_cmd_mpa": 1}, "facts": {}}]\n'),
        sealed(b'[{"rows": 1e18, "apart": 1, "period_s": 1, "steps": {"dp_cmd_mpa": 1}, "columns": []}]\n'),
        sealed(b"[" * 100_000),
    ],
)
def test_what_is_none_is_refused_in_one_line(text: str) -> None:
    with pytest.raises(ModelError, match="cannot be read") as caught:
        unpacked(text)
    assert "\n" not in str(caught.value)


def test_a_text_that_unpacks_to_too_much_is_no_file_of_ours() -> None:
    with pytest.raises(ModelError, match="cannot be read"):
        unpacked(sealed(bytes(64 * 1024 * 1024)))
