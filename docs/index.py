"""The index of docs/README.md: `python docs/index.py` writes one line a page, from the page's own title, in the four
sections."""

from pathlib import Path

DOCS = Path(__file__).resolve().parent
SECTIONS = {
    "tutorial": "Tutorials",
    "how-to": "How to",
    "reference": "Reference",
    "explanation": "Explanations",
    "decisions": "Decisions, and why",
}
FIRST = ("first_sweep", "what_the_simulator_lacks", "diagnose_practice", "real_joint", "diagnose_real_joint")
"""Tutorials in the order in which a newcomer needs them; the other pages stand by the alphabet."""
_BEGIN, _END = "<!-- index -->\n", "<!-- end index -->\n"


def title(page: Path) -> str:
    """The first heading of a page."""
    return next(line[2:] for line in page.read_text(encoding="utf-8").splitlines() if line.startswith("# "))


def place(name: str) -> int:
    """Where a page stands before the alphabet decides."""
    return FIRST.index(name) if name in FIRST else len(FIRST)


def index() -> str:
    """All sections that hold pages."""
    parts = []
    for folder, heading in SECTIONS.items():
        found = sorted((DOCS / folder).glob("*.md"), key=lambda page: (place(page.stem), page.name))
        if found:
            lines = "".join(f"- [{title(page)}]({folder}/{page.name})\n" for page in found)
            parts.append(f"## {heading}\n\n{lines}")
    return "\n".join(parts)


def filled(text: str) -> str:
    """README.md with the index as it should be."""
    before, rest = text.split(_BEGIN)
    return f"{before}{_BEGIN}{index()}{_END}{rest.split(_END)[1]}"


if __name__ == "__main__":
    readme = DOCS / "README.md"
    readme.write_text(filled(readme.read_text(encoding="utf-8")), encoding="utf-8")
