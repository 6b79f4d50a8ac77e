"""Numbers out of text tables: every style gives the same numbers back, and what may be read in two ways is refused."""

import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.writer import Writer
from support.records.mapped_files import read_mapped

from rig.errors import ConfigError, RecordError
from rig.log.foreign.delimited import Style, read_table
from rig.log.foreign.mapping import load_mapping
from rig.log.mcap import schema
from rig.log.mcap.columns import pack_columns

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


def test_a_column_that_is_not_wanted_may_hold_anything(tmp_path: Path) -> None:
    path = table_in(tmp_path, 'stamp,a,note\n2024-03-04T10:00:00,1,"x, y"\n,2,\n')
    read = read_table(path, wanted=["a"])
    assert read["a"].tolist() == [1.0, 2.0]
    assert np.isnan(read["note"]).all()
    with pytest.raises(RecordError, match="row 2: note: 'x, y' is not a number"):
        read_table(path)


def test_a_mapping_asks_for_its_own_columns_alone(tmp_path: Path) -> None:
    mapping = tmp_path / "mapping.yaml"
    mapping.write_text("columns: {dp_cmd_mpa: {source: u, unit: bar}}\nperiod_s: 0.01\n")
    path = table_in(tmp_path, "when,u\n4 March,1\n4 March,2\n")
    assert read_mapped(path, load_mapping(mapping))[0]["dp_cmd_mpa"].tolist() == [0.1, 0.2]


def test_a_mapping_of_nothing_is_refused(tmp_path: Path) -> None:
    (tmp_path / "mapping.yaml").write_text("columns: {}\nperiod_s: 0.01\n")
    with pytest.raises(ConfigError, match="expected `columns:`, a mapping of our columns to their sources"):
        load_mapping(tmp_path / "mapping.yaml")


def test_two_kinds_of_messages_on_one_topic_are_each_read_by_their_own(tmp_path: Path) -> None:
    """As in a file merged of two: the messages of one schema were taken apart by the other's."""
    path, mapping = tmp_path / "f.mcap", tmp_path / "mapping.yaml"
    swapped = dict(reversed(schema.REPLAY_WIRES.items()))
    with path.open("wb") as out:
        writer = Writer(out)
        writer.start()
        for time_ns, wires in ((0, schema.REPLAY_WIRES), (1_000_000, swapped)):
            descriptors = schema.descriptor_set(schema.REPLAY_SCHEMA, wires)
            kind = writer.register_schema(schema.REPLAY_SCHEMA, "protobuf", descriptors)
            columns = {name: np.ones(1) for name in wires} | {"angle_deg": np.full(1, 2.0)}
            (row,) = pack_columns(columns, wires)
            writer.add_message(writer.register_channel("/x", "protobuf", kind), time_ns, row.tobytes(), time_ns)
        writer.finish()
    sources = "{t_s: {source: log_time}, angle_deg: {source: angle_deg}, dp_cmd_mpa: {source: tick, unit: MPa}}"
    mapping.write_text(f"topic: /x\ncolumns: {sources}\n")
    assert read_mapped(path, load_mapping(mapping))[0]["angle_deg"].tolist() == [2.0, 2.0]
