"""Decisions: each names what else was considered, and why not."""

import re
from pathlib import Path

import pytest
from conftest import ROOT

DECISIONS = sorted((ROOT / "docs" / "decisions").glob("[0-9]*.md"))
CONSIDERED = re.compile(r"^\*\*Alternatives\.\*\*(.+?)(?=^\*\*[A-Z]|\Z)", re.MULTILINE | re.DOTALL)
LEAST_WORDS = 12
"""Fewer name something and do not say why not."""


def considered(text: str) -> bool:
    return sum(len(part.split()) for part in CONSIDERED.findall(text)) >= LEAST_WORDS


@pytest.mark.parametrize("page", DECISIONS, ids=lambda page: page.name[:4])
def test_a_decision_says_what_else_was_considered_and_why_not(page: Path) -> None:
    assert considered(page.read_text(encoding="utf-8")), f"{page.name}: no '**Alternatives.** WHAT: why not.'"


@pytest.mark.parametrize(
    "text",
    [
        "# A page\n\nIt was decided, and nobody says what else there was, however many words there are.\n",
        "**Alternatives.** A queue.\n\n**Price.** A slot in shared memory, and a reader who must count what is lost.\n",
    ],
)
def test_one_that_does_not_is_seen(text: str) -> None:
    assert not considered(text)


def test_every_decision_has_a_number_of_its_own() -> None:
    numbers = [page.name[:4] for page in DECISIONS]
    assert len(numbers) == len(set(numbers))


def test_its_title_begins_with_that_number() -> None:
    """So that a number that a page names is found in the index."""
    titles = {page.name[:4]: page.read_text(encoding="utf-8").partition("\n")[0] for page in DECISIONS}
    assert not [title for number, title in titles.items() if not re.match(rf"# {number}:? \S", title)]
