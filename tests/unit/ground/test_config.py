"""Configs, strictly: everything that is wrong ends in one line that says what, where, and what is allowed."""

import contextlib
import datetime
import os
import time
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from rig import config
from rig.config import load, read_yaml, strict_yaml, structure, suggest, unstructure
from rig.errors import ConfigError
from rig.fields import bounded


class Colour(Enum):
    RED = "red"
    GREEN = "green"


@dataclass(frozen=True)
class Inner:
    length_s: float = bounded(0.0, 10.0, "s", default=1.0)
    pair_mpa: tuple[float, float] = bounded(0.0, 1.0, "MPa", default=(0.0, 0.5))
    colour: Colour = Colour.RED


@dataclass(frozen=True)
class Outer:
    name: str
    count: int = bounded(1, 5, default=1)
    quick: bool = False
    inner: Inner = field(default_factory=Inner)
    several: list[Inner] = field(default_factory=list)
    named: dict[str, Inner] = field(default_factory=dict)
    path: Path | None = None
    free: float = 0.0


def fails(raw: Any, schema: type = Outer) -> str:
    with pytest.raises(ConfigError) as error:
        structure(raw, schema, "x.yaml")
    line = str(error.value)
    assert line.startswith("x.yaml: ")
    assert "\n" not in line
    return line.removeprefix("x.yaml: ")


def test_what_fits_comes_out_typed() -> None:
    raw = {
        "name": "a",
        "inner": {"length_s": 2, "colour": "green"},
        "several": [{}],
        "named": {"k": {"pair_mpa": [0, 1]}},
        "path": "p",
    }
    value = structure(raw, Outer, "x.yaml")
    assert value.inner == Inner(2.0, (0.0, 0.5), Colour.GREEN)
    assert isinstance(value.inner.length_s, float)
    assert (value.several, value.named["k"].pair_mpa, value.path) == ([Inner()], (0.0, 1.0), Path("p"))
    assert structure(unstructure(value), Outer, "x.yaml") == value


@pytest.mark.parametrize(
    ("raw", "line"),
    [
        ({}, "the key 'name' is missing"),
        ({"name": "a", "inner": {"lenght_s": 1}}, "inner: unknown key 'lenght_s'; did you mean 'length_s'?"),
        ({"nmae": "a"}, "unknown key 'nmae'; did you mean 'name'?"),
        (
            {"name": "a", 7: None, "zz": 2},  # {free: 0,7}
            "a number, 7, stands where a key should; decimals have a point, not a comma",
        ),
        ({"name": "a", "named": [{"k": {}}]}, "named: expected a mapping, got a list"),
        ({"name": 3}, "name: expected text, got 3"),
        ({"name": "a", "count": 1.5}, "count: expected a whole number, got 1.5"),
        ({"name": "a", "count": True}, "count: expected a whole number, got True"),
        ({"name": "a", "count": 9}, "count: 9 is outside 1 .. 5"),
        ({"name": "a", "quick": "yes"}, "quick: expected true or false, got 'yes'"),
        ({"name": "a", "quick": 1}, "quick: expected true or false, got 1"),
        ({"name": "a", "inner": {"length_s": "2 s"}}, "inner.length_s: expected a number, got '2 s'"),
        ({"name": "a", "inner": {"length_s": float("nan")}}, "inner.length_s: expected a finite number, got nan"),
        (
            {"name": "a", "inner": {"length_s": 10**400}},
            "inner.length_s: a number of more than 20 digits s is outside 0 .. 10 s",
        ),
        ({"name": "a", "free": 10**400}, "free: expected a number below 1.8e+308, got a number of more than 20 digits"),
        ({"name": "a", "count": -(10**400)}, "count: a number of more than 20 digits is outside 1 .. 5"),
        ({"name": "a", "quick": 10**400}, "quick: expected true or false, got a number of more than 20 digits"),
        (
            {"name": "a", "path": "a\0b"},
            "path: expected a path, got 'a\\x00b' with a character that no file name can have",
        ),
        (
            {"name": "a", "path": "\ud800"},
            "path: expected a path, got '\\ud800' with a character that no file name can have",
        ),
        ({"name": "a", "inner": {"length_s": 11}}, "inner.length_s: 11 s is outside 0 .. 10 s"),
        ({"name": "a", "inner": {"pair_mpa": [0.1]}}, "inner.pair_mpa: expected 2 values, got 1"),
        ({"name": "a", "inner": {"pair_mpa": 0.1}}, "inner.pair_mpa: expected a list, got 0.1"),
        ({"name": "a", "inner": {"pair_mpa": [0.1, "b"]}}, "inner.pair_mpa[1]: expected a number, got 'b'"),
        (
            {"name": "a", "inner": {"pair_mpa": [0.1, 2]}},
            "inner.pair_mpa: 2 MPa is outside 0 .. 1 MPa; 2 bar are 0.2 MPa",
        ),
        (
            {"name": "a", "inner": {"pair_mpa": [0, 500]}},
            "inner.pair_mpa: 500 MPa is outside 0 .. 1 MPa; 500 kPa are 0.5 MPa",
        ),
        ({"name": "a", "inner": {"length_s": 500}}, "inner.length_s: 500 s is outside 0 .. 10 s; 500 ms are 0.5 s"),
        ({"name": "a", "inner": {"colour": "gren"}}, "inner.colour: unknown value 'gren'; did you mean 'green'?"),
        ({"name": "a", "inner": 3}, "inner: expected a mapping with the keys length_s, pair_mpa, colour; got 3"),
        ({"name": "a", "several": [{}, {"length_s": -1}]}, "several[1].length_s: -1 s is outside 0 .. 10 s"),
        ({"name": "a", "named": {"k": {"x": 1}}}, "named.k: unknown key 'x'; allowed: colour, length_s, pair_mpa"),
        (None, "expected a mapping with the keys name, count, quick, inner, several, named, path, free; got nothing"),
        ([1], "expected a mapping with the keys name, count, quick, inner, several, named, path, free; got a list"),
    ],
)
def test_what_does_not_fit_is_one_line(raw: Any, line: str) -> None:
    said = fails(raw)
    assert said == line


BROKEN = {
    "a tab": "a:\t- b\n  c",
    "twice the same key": "name: a\nname: b\n",
    "a key that is a list": "? [a, b]\n: 1\n",
    "a key that is a mapping": "{{}: 1}",
    "a control character": "name: \x01",
    "an alias of nothing": "name: *x\n",
    "a loop": "name: &a [*a]\n",
    "a python object": '!!python/object/apply:os.system ["true"]',
    "bad base64": "name: !!binary abc\n",
    "too deep": "[" * 1200,
    "a forced date that is none": "name: !!timestamp 2020-13-45\n",
    "a forced date that looks like none": "name: !!timestamp x\n",
}


@pytest.mark.parametrize("text", BROKEN.values(), ids=BROKEN.keys())
def test_broken_yaml_is_one_line_with_the_file(tmp_path: Path, text: str) -> None:
    path = tmp_path / "broken.yaml"
    path.write_text(text)
    with pytest.raises(ConfigError) as error:
        load(path, Outer)
    assert str(error.value).startswith(f"{path}")
    assert "not valid YAML: " in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("text", "value"),
    [("1e-3", 0.001), ("1e3", 1000.0), (".5", 0.5), ("-1.5E+2", -150.0), ("12", 12), ("0x1F", 31), ("010", "010"),
    ("1:30", "1:30"),
     ("1_000", "1_000"), ("2020-01-01", "2020-01-01"), ("true", True), (".inf", float("inf"))],
)  # fmt: skip
def test_numbers_are_what_they_look_like(tmp_path: Path, text: str, value: object) -> None:
    path = tmp_path / "n.yaml"
    path.write_text(f"a: {text}\n")
    assert read_yaml(path) == {"a": value}


@pytest.mark.parametrize("word", ["on", "off", "y", "n", "yes", "No"])
def test_a_key_is_the_word_that_it_looks_like(tmp_path: Path, word: str) -> None:
    """`web: {on: false}` in a daemon's settings had a key that was true."""
    path = tmp_path / "n.yaml"
    path.write_text(f"web: {{{word}: off}}\n")
    assert read_yaml(path) == {"web": {word: False}}


def test_a_missing_file_is_told_with_its_neighbour(tmp_path: Path) -> None:
    (tmp_path / "simulated.yaml").write_text("")
    with pytest.raises(ConfigError, match=r"simulatd.yaml: no such file; did you mean .*/simulated.yaml\?"):
        read_yaml(tmp_path / "simulatd.yaml")
    with pytest.raises(ConfigError, match=r"no such file \(nor a folder .*nowhere\)"):
        read_yaml(tmp_path / "nowhere" / "a.yaml")
    with pytest.raises(ConfigError, match="cannot be read: it is a folder, and a file is meant"):
        read_yaml(tmp_path)
    (tmp_path / "latin.yaml").write_bytes(b"name: \xff")
    with pytest.raises(ConfigError, match="cannot be read: it is not UTF-8 text"):
        read_yaml(tmp_path / "latin.yaml")


def test_a_number_outside_its_range_is_refused_before_anything_is_built_from_it() -> None:
    @dataclass(frozen=True)
    class Built:
        length: int = bounded(1, 10)

        def __post_init__(self) -> None:
            assert self.length <= 10, "built from a number that nobody had looked at"

    assert fails({"length": 2**31 - 1}, Built) == "length: 2.14748e+09 is outside 1 .. 10"


@pytest.mark.parametrize("name", ["a\0b", "a\ud800"])
def test_a_name_that_no_file_can_have_is_one_line(name: str) -> None:
    with pytest.raises(ConfigError, match=r"cannot be read: no file can have such a name"):
        read_yaml(Path(f"/tmp/{name}"))


def laughs(depth: int) -> str:
    """Ten of ten of ten: a text of some lines that stands for 10 ** `depth` values."""
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 10)}]" for n in range(1, depth)]
    return "\n".join(lines)


def merges(depth: int) -> str:
    """The same by merging mappings, which are copied while they are read."""
    lines = ["a0: &a0 {k: 1}"]
    lines += [f"a{n}: &a{n} {{<<: [{', '.join([f'*a{n - 1}'] * 10)}]}}" for n in range(1, depth)]
    return "\n".join(lines)


@pytest.mark.parametrize("text", [laughs(9), merges(9)], ids=["lists", "merges"])
def test_aliases_that_multiply_count_as_what_they_stand_for(tmp_path: Path, text: str) -> None:
    (tmp_path / "laughs.yaml").write_text(text)
    began = time.process_time()
    with pytest.raises(ConfigError, match=r"not valid YAML: it stands for more than 500000 values, written out"):
        read_yaml(tmp_path / "laughs.yaml")
    assert time.process_time() - began < 2.0


def test_aliases_that_stay_small_are_welcome(tmp_path: Path) -> None:
    (tmp_path / "few.yaml").write_text("common: &c {a: 1}\none: {<<: *c, b: 2}\ntwo: [*c, *c]\n")
    assert read_yaml(tmp_path / "few.yaml") == {
        "common": {"a": 1},
        "one": {"a": 1, "b": 2},
        "two": [{"a": 1}, {"a": 1}],
    }


def test_suggestions() -> None:
    assert suggest("sinus", ["sine", "chirp"]) == "did you mean 'sine'?"
    assert suggest("q", ["sine", "chirp"]) == "allowed: chirp, sine"


PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(st.sampled_from([*Outer.__dataclass_fields__, "x"]), inner, max_size=4)
    ),
    max_leaves=5,
)


def outcome(raw: Any) -> Outer | str:
    try:
        return structure(raw, Outer, "x.yaml")
    except ConfigError as error:
        return str(error)


@settings(max_examples=50)
@given(PLAIN)
def test_plain_data_either_fits_or_is_one_line(raw: Any) -> None:
    value = outcome(raw)
    assert "\n" not in value if isinstance(value, str) else 1 <= value.count <= 5


@given(st.text(max_size=60))
def test_any_text_is_yaml_or_one_line(text: str) -> None:
    with contextlib.suppress(yaml.YAMLError, ValueError):
        assert is_plain(yaml.load(text, Loader=strict_yaml.StrictLoader))


def is_plain(value: object) -> bool:
    """Plain data all the way down: what a file of somebody else's may make of itself."""
    if isinstance(value, dict):
        return all(is_plain(part) for pair in value.items() for part in pair)
    if isinstance(value, list | tuple | set):
        return all(is_plain(part) for part in value)
    return value is None or isinstance(value, str | int | float | bytes | datetime.date)


def test_a_pipe_or_a_device_is_refused_and_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(pipe := tmp_path / "pipe.yaml")
    for endless in (pipe, Path("/dev/zero")):
        with pytest.raises(ConfigError, match="cannot be read: it is not a regular file"):
            read_yaml(endless)


def test_a_huge_file_is_refused_unread(tmp_path: Path) -> None:
    with (path := tmp_path / "huge.yaml").open("wb") as file:
        file.truncate(config.MOST_CONFIG_BYTES + 1)
    with pytest.raises(ConfigError, match=r"it has 4194305 bytes, allowed are 4194304"):
        read_yaml(path)
