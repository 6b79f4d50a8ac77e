"""The indexes of the pages, one line a page from the page's own title: `python docs/index.py` writes docs/README.md, in
which every page but the decisions stands, and docs/decisions/README.md with these, by what they are about, each with
what was chosen and with the later ones that speak of it."""

import re
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
            "Simulator and diagnosis": (
                "identify",
                "your_own_simulator",
                "diagnose_a_campaign",
                "capability",
                "plan_an_experiment",
            ),
            "Extend it, and check it": ("add_a_device", "add_an_effect", "blind_check", "refit_the_priors"),
        },
    ),
    "reference": (
        "Reference",
        {
            "What you write": ("rig_config", "devices", "sweeps", "model"),
            "What you read": ("effects", "diagnosis_json", "log_format", "sample", "states", "fault_table"),
            "Programs": ("options", "python", "control_protocol"),
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
PARTS = {
    "00": "Loop and sample",
    "01": "Identification",
    "02": "Records and commands",
    "03": "Devices",
    "04": "Service and safety",
    "05": "Diagnosis",
    "06": "Blind check",
    "07": "Layout of the code, and its tests",
    "08": "Closed loop",
    "09": "Python, other rigs, other simulators",
}
"""First two digits of a decision -> what it is about."""
FULL = {
    "0612": "05",
    "0613": "05",
    **{f"06{k}": "05" for k in range(15, 100)},
    "0721": "05",
    "0727": "05",
    "0728": "05",
}
"""Decisions on the diagnosis that stand under other digits, since those of its own are used up."""
MOST_LETTERS = 220
"""Of what was chosen, in the index."""
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


def chosen(page: Path) -> str:
    """What was chosen, in the first sentence that says it; links and code without their marks."""
    text = page.read_text(encoding="utf-8")
    told = re.search(r"^\*\*(?:Choice|Decision)[^*]*\*\*\s*(.+)", text, re.MULTILINE) or re.search(
        r"^(?![#*]).+", text, re.M
    )
    plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", told.group(told.lastindex or 0) if told else "")
    plain = re.sub(r"^\d\. ", "", plain)  # the first of a list
    sentence = re.split(r"(?<=[a-z0-9)`*])[.:;] ", plain, maxsplit=1)[0].strip().rstrip(".:;")
    return f"{sentence}." if len(sentence) <= MOST_LETTERS else f"{sentence[:MOST_LETTERS].rsplit(' ', 1)[0]} ..."


def later(page: Path, pages: list[Path]) -> list[str]:
    """The numbers of the later decisions that speak of this one."""
    return [
        one.name[:4] for one in pages if one.name[:4] > page.name[:4] and page.name in one.read_text(encoding="utf-8")
    ]


def decision_lines() -> str:
    """The decisions by what they are about: title, what was chosen, which later ones speak of it."""
    pages, parts = decisions(), []
    for digits, about in PARTS.items():
        parts.append(f"\n## {about}\n\n")
        for page in (one for one in pages if FULL.get(one.name[:4], one.name[:2]) == digits):
            since = later(page, pages)
            spoken = f" Later: {', '.join(since)}." if since else ""
            parts.append(f"- [{title(page)}]({page.name}): {chosen(page)}{spoken}\n")
    return "".join(parts)


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
    listed = {DOCS / "README.md": index(), DECISIONS: decision_lines()}
    return {page: filled(page.read_text(encoding="utf-8"), found) for page, found in listed.items()}


if __name__ == "__main__":
    for page, text in indexes().items():
        page.write_text(text, encoding="utf-8")
