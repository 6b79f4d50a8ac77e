"""The indexes of the pages, one line a page from the page's own title: `python docs/index.py` writes docs/README.md, in
which every page but the decisions stands, and docs/decisions/README.md with these."""

from pathlib import Path

DOCS = Path(__file__).resolve().parent
SECTIONS: dict[str, tuple[str, dict[str, tuple[str, ...]]]] = {
    "tutorial": (
        "Tutorials",
        {
            "": (
                "first_sweep",
                "what_the_simulator_lacks",
                "diagnose_practice",
                "close_the_loop",
                "real_joint",
                "diagnose_real_joint",
            )
        },
    ),
    "how-to": (
        "How to",
        {
            "A rig of your own": (
                "install",
                "own_rig",
                "modbus_modules",
                "serial_valves",
                "bring_up",
                "calibrate",
                "install_service",
            ),
            "Run it": ("operate_the_daemon", "replay", "follow_an_angle", "rig_in_ci"),
            "Records": ("import_labview", "open_in_other_tools", "compare_records", "recover"),
            "Simulator and diagnosis": ("identify", "your_own_simulator", "diagnose_a_campaign", "plan_an_experiment"),
            "Extend it, and check it": ("add_a_device", "add_an_effect", "blind_check"),
        },
    ),
    "reference": (
        "Reference",
        {
            "What you write": ("rig_config", "devices", "sweeps", "model"),
            "What you read": ("effects", "diagnosis_json", "log_format", "sample", "states", "fault_table"),
            "Programs": ("python", "control_protocol"),
            "What was measured": (
                "diagnosis_results",
                "blind_check_results",
                "blind_check_wrist",
                "real_records",
                "smallest_sizes",
                "loop_results",
                "safety_results",
                "measured",
                "figures",
                "library_figures",
                "blind_check_history",
                "structure",
            ),
        },
    ),
    "explanation": (
        "Explanations",
        {
            "": (
                "diagnosis",
                "blind_check",
                "paper_findings",
                "loop",
                "safety",
                "tracking",
                "comparison",
                "overview",
                "glossary",
            )
        },
    ),
}
"""Folder -> its heading, and its pages in the order in which somebody needs them, by what they are about. A page that
stands in none of these follows the last one."""
DECISIONS = DOCS / "decisions" / "README.md"
_BEGIN, _END = "<!-- index -->\n", "<!-- end index -->\n"


def title(page: Path) -> str:
    """The first heading of a page."""
    return next(line[2:] for line in page.read_text(encoding="utf-8").splitlines() if line.startswith("# "))


def groups(folder: str) -> list[tuple[str, list[Path]]]:
    """(what they are about, pages) of a section."""
    found = {page.stem: page for page in sorted((DOCS / folder).glob("*.md"))}
    listed = [(about, [found.pop(name) for name in names]) for about, names in SECTIONS[folder][1].items()]
    listed[-1][1].extend(found.values())
    return listed


def decisions() -> list[Path]:
    """The pages of the decisions, by their numbers."""
    return sorted(DECISIONS.parent.glob("[0-9]*.md"))


def lines(pages: list[Path], start: Path) -> str:
    """A line a page, with its way from the folder of the index."""
    return "".join(f"- [{title(page)}]({page.relative_to(start).as_posix()})\n" for page in pages)


def index() -> str:
    """All sections."""
    parts = []
    for folder, (heading, _) in SECTIONS.items():
        parts.append(f"## {heading}\n")
        parts += [(f"{about}:\n\n" if about else "") + lines(pages, DOCS) for about, pages in groups(folder)]
    return "\n".join(parts)


def filled(text: str, listed: str) -> str:
    """An index page with what it should list."""
    before, rest = text.split(_BEGIN)
    return f"{before}{_BEGIN}{listed}{_END}{rest.split(_END)[1]}"


def indexes() -> dict[Path, str]:
    """Each index page -> its text as it should be."""
    listed = {DOCS / "README.md": index(), DECISIONS: lines(decisions(), DECISIONS.parent)}
    return {page: filled(page.read_text(encoding="utf-8"), found) for page, found in listed.items()}


if __name__ == "__main__":
    for page, text in indexes().items():
        page.write_text(text, encoding="utf-8")
