"""Numbers out of text tables: every style gives the same numbers back, and what may be read in two ways is refused."""

import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.errors import RecordError
from rig.log.foreign.delimited import Style, read_table

NUMBERS = st.floats(allow_nan=False, allow_infinity=False, width=64)
STYLES = [Style(), Style(";"), Style("\t"), Style(";", ","), Style("\t", ",")]


def table_in(folder: Path, text: str) -> Path:
    path = folder / "table.csv"
    path.write_text(text, encoding="utf-8")
    return path


@given(
    rows=st.lists(st.tuples(NUMBERS, NUMBERS, NUMBERS | st.none()), min_size=1, max_size=20),
    style=st.sampled_from(STYLES),
    quoted=st.booleans(),
)
def test_every_style_gives_the_numbers_back(
    rows: list[tuple[float, float, float | None]], style: Style, quoted: bool
) -> None:
    mark = '"' if quoted else ""

    def cell(value: float | None) -> str:
        return "" if value is None else f"{mark}{value!r}{mark}".replace(".", style.decimal)

    lines = [style.separator.join("abc"), *(style.separator.join(map(cell, row)) for row in rows)]
    with tempfile.TemporaryDirectory() as folder:
        read = read_table(table_in(Path(folder), "\n".join(lines) + "\n"), style)
    wanted = np.array([[np.nan if value is None else value for value in row] for row in rows])
    assert np.array_equal(np.stack(list(read.values()), axis=1), wanted, equal_nan=True)


@pytest.mark.parametrize(
    ("text", "style", "said"),
    [
        ('a,b\n0,0\n"1\n",0.1\n2,0.2\n', Style(), "row 3: a cell in quotes goes on in the next line"),
        ('a,b\n0,0\n"1\n', Style(), "not a table"),
        ("a;b\n0;1.234\n1;1,5\n", Style(";", ","), "row 2: b: '1.234' is not a number; a point beside decimal commas"),
        ("a;b\n0;1.234,5\n", Style(";", ","), "row 2: b: '1.234,5' is not a number; a point beside"),
        ("a,b\n0,1_000\n", Style(), "row 2: b: '1_000' is not a number"),
    ],
)
def test_what_may_be_read_in_two_ways_is_refused(tmp_path: Path, text: str, style: Style, said: str) -> None:
    with pytest.raises(RecordError, match=said) as caught:
        read_table(table_in(tmp_path, text), style)
    assert "\n" not in str(caught.value)
