"""The page reads what the diagnosis writes: a field that was renamed is found here, not by who asks for a page."""

import re
from dataclasses import fields
from importlib.resources import files

import pytest
from jinja2 import Template

from rig.gap.raw_tests.signature import Signature
from rig.report.templates import rendered

ROOM = files("rig.report")
PAGE = ROOM.joinpath("gap_page.html.jinja").read_text(encoding="utf-8")


def test_a_signature_is_read_by_the_names_that_it_has() -> None:
    used = set(re.findall(r"\braw\.(\w+)", PAGE))
    assert used
    assert used <= {field.name for field in fields(Signature)}


@pytest.mark.parametrize("name", ["gap_page.html.jinja", "campaign_page.py"])
def test_on_a_phone_a_row_of_many_cells_is_laid_out_as_lines_that_say_what_they_are(name: str) -> None:
    page = ROOM.joinpath(name).read_text(encoding="utf-8")
    tables = re.findall(r"<table([^>]*)>(.*?)</table>", page, re.DOTALL)
    assert tables
    for how, table in tables:
        heads = len(re.findall(r"<th\b", table))
        said = re.findall(r'<td\b[^>]*data-is="', table)
        assert (heads <= 3) or ("wide" in how and len(said) >= heads - 2), table[:200]


@pytest.mark.parametrize(
    ("probability", "said"),
    [
        ({"none": 0.7, "friction": 0.2, "delay": 0.1}, "friction 0.20, delay 0.10"),
        ({"delay": 1.0}, "delay 1.00"),
        ({"none": 1.0}, "nothing else"),
        ({}, "nothing else"),
    ],
)
def test_what_else_is_possible_is_never_left_empty(probability: dict[str, float], said: str) -> None:
    (cell,) = re.findall(r'<td data-is="else possible">(.*?)</td>', PAGE, re.DOTALL)
    assert Template(cell).render(factor={"probability": probability}) == said


def test_what_a_record_says_of_itself_is_shown_and_obeyed_by_nobody() -> None:
    page = rendered("<td>{{ note }}</td>{{ drawn | safe }}", note="\x1b[2J<b>\nleft", drawn="<svg/>")
    assert page == r"<td>\x1b[2J&lt;b&gt;" + "\nleft</td><svg/>"
