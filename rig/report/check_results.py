"""The result of a blind check as a page of the documentation: Markdown, dated, with its seeds and hashes, goals beside
the figures, and what was missed.

Everything here is drawn from the check's JSON; no figure is computed anew.
"""

from collections.abc import Iterator, Mapping, Sequence
from datetime import date
from typing import Any

from rig.blind_check.goals import GOALS, bound, figure, figure_text, reached
from rig.blind_check.modes import GROUPS, MODES
from rig.report.check_words import FAMILY_FIGURES, MODE_WORDS, MODES_A_TABLE, NAIVE_WORDS

MEANT = 400
"""Cases a mode on which the goals are to be reached."""


def as_markdown(result: Mapping[str, Any]) -> str:
    """The page."""
    shown = {MODE_WORDS[mode]: result["modes"][mode] for mode in result["modes"]}
    judged = [name for name in result["families"] if name not in result["fitted_on"]]
    parts = [
        _head(result, judged),
        *_goals(f"All {result['cases']} cases", result["modes"]),
        *(part for name in result["families"] for part in _family(result, name)),
        *_named("Before and after recommended experiments", _experiments(result["modes"])),
        *_named("What was missed", _missed(result["modes"])),
        *_named("Answers that contradict themselves", _contradicting(shown)),
        *_named("By strength", _broken_down("gap over floor", "by_ratio", ("detected", "exact_first"), shown)),
        *_named("By effect", _broken_down("effect", "by_effect", ("exact_first", "truth_in_set"), shown)),
        *_named("Effects of no library, flagged", _foreign(shown)),
        *_named("The right class left out of the library, flagged", _withheld(result["withheld"])),
        *_named("Beside the diagnosis: what simpler methods reach", _naive(result["naive"])),
    ]
    return "\n".join(parts)


def _head(result: Mapping[str, Any], judged: Sequence[str]) -> str:
    checks = result.get("parts") or [
        {
            "seed": result.get("seed", "-"), "cases": result["cases"], "scored": result["cases"],
            "sealed_sha256": result["sealed_sha256"], "fitted_on": result["fitted_on"],
        }
    ]  # fmt: skip
    kinds = ", ".join(f"{count} {kind}" for kind, count in result["kinds"].items())
    untouched = (
        f"the levels that judged {', '.join(judged)} were fitted on other families"
        if judged
        else "there is none on which nothing was fitted"
    )
    missing = f" (this system offered no {', '.join(result['sandbox_missing'])})" if result["sandbox_missing"] else ""
    words = (
        f"Written by `pamrig gap check` on {date.today().isoformat()} from {result['cases']} cases ({kinds}). Of the "
        f"families judged here, {untouched}. The answering processes were shut in by: "
        f"{', '.join(result['sandbox_layers'])}{missing}. "
        f"Rates carry Wilson 95 % intervals and counts; names count for single effects from three floors on. "
        f"{_few(result)}"
        "[What is counted]"
        "(../explanation/blind_check.md), [how to run it](../how-to/blind_check.md), [earlier checks and all seeds]"
        "(blind_check_history.md)."
    )
    rows = [
        [
            str(part["seed"]), f"{part['scored']} of {part['cases']}", ", ".join(part["fitted_on"]),
            f"`{part['sealed_sha256']}`",
        ]
        for part in checks
    ]  # fmt: skip
    table = _table("seed | cases scored | levels fitted on | SHA-256 of the labels, printed before the run", rows)
    return f"# Results of the blind check\n\n{words}\n\n{table}"


def _few(result: Mapping[str, Any]) -> str:
    """A word on intervals that are wide because a mode was asked of few cases."""
    asked = min(mode["contradictions"]["n"] for mode in result["modes"].values())
    return (
        f"The goals are meant on {MEANT} cases a mode; the least asked here was asked of {asked}. "
        if asked < MEANT
        else ""
    )


def _family(result: Mapping[str, Any], name: str) -> list[str]:
    """One family of plants apart; all figures where nothing was fitted on it and there are others."""
    modes = result["families"][name]
    if len(result["families"]) > 1 and name not in result["fitted_on"]:
        return _goals(f"On {name}, on which nothing was fitted", modes)
    head = " | ".join([f"family {name}", *(key.replace("_", " ") for key in FAMILY_FIGURES)])
    rows = [[MODE_WORDS[mode], *(_cell(found[key]) for key in FAMILY_FIGURES)] for mode, found in modes.items()]
    return [f"## Family {name}\n", _table(head, rows)]


def _goals(title: str, modes: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """The goals' figures, a few modes a table."""
    parts = [f"## {title}\n"]
    for group in GROUPS.values():
        names = [mode.name for mode in group if mode.name in modes]
        pairs = [names[start : start + MODES_A_TABLE] for start in range(0, len(names), MODES_A_TABLE)]
        parts += [_goals_of({name: modes[name] for name in some}) for some in pairs]
    return parts


def _goals_of(modes: Mapping[str, Mapping[str, Any]]) -> str:
    rows = []
    for goal in GOALS:
        cells = [_with_goal(found, goal, name) for name, found in modes.items()]
        rows.append([goal.words, *(text for cell in cells for text in cell)])
    return _table(" | ".join(["figure", *(f"{MODE_WORDS[name]} | goal" for name in modes)]), rows)


def _with_goal(mode: Mapping[str, Any], goal: Any, name: str) -> tuple[str, str]:
    missed = " **missed**" if reached(mode, goal, name) is False else ""
    return figure_text(figure(mode, goal), goal.unit) + missed, bound(goal, name)


def _missed(modes: Mapping[str, Mapping[str, Any]]) -> str:
    """Every goal that was not reached, mode by mode."""
    rows = [
        [MODE_WORDS[name], goal.words, figure_text(figure(found, goal), goal.unit), bound(goal, name)]
        for name, found in modes.items()
        for goal in GOALS
        if reached(found, goal, name) is False
    ]
    return _table("asked | figure | reached | goal", rows) if rows else ""


def _contradicting(shown: Mapping[str, Mapping[str, Any]]) -> str:
    rows = [[words, sentence, str(n)] for words, mode in shown.items() for sentence, n in mode["contradicting"].items()]
    return _table("asked | what | answers", rows) if rows else ""


def _named(title: str, table: str) -> Iterator[str]:
    """A table with a title; nothing for an empty one."""
    if table:
        yield from (f"## {title}\n", table)


def _broken_down(what: str, key: str, figures: Sequence[str], shown: Mapping[str, Mapping[str, Any]]) -> str:
    full = [(words, mode) for words, mode in shown.items() if MODES[_mode(words)].pressures]
    titles = [f"{name.replace('_', ' ')}, {words}" for words, _ in full for name in figures]
    names = dict.fromkeys(name for _, mode in full for name in mode[key])
    rows = [
        [name, *(_cell(mode[key].get(name, {}).get(each)) for _, mode in full for each in figures)] for name in names
    ]
    return _table(" | ".join([what, *titles]), rows) if rows else ""


def _mode(words: str) -> str:
    return next(name for name, known in MODE_WORDS.items() if known == words)


def _foreign(shown: Mapping[str, Mapping[str, Any]]) -> str:
    names = dict.fromkeys(name for mode in shown.values() for name in mode["unknown_by_effect"])
    rows = [[name, *(_cell(mode["unknown_by_effect"].get(name)) for mode in shown.values())] for name in names]
    return _table(" | ".join(["effect of no library", *shown]), rows) if rows else ""


def _withheld(found: Mapping[str, Mapping[str, Any]]) -> str:
    names = dict.fromkeys(name for mode in found.values() for name in mode["flagged_by_effect"])
    rows = [[name, *(_cell(mode["flagged_by_effect"].get(name)) for mode in found.values())] for name in names]
    return _table(" | ".join(["class withheld", *(MODE_WORDS[mode] for mode in found)]), rows) if rows else ""


def _experiments(modes: Mapping[str, Mapping[str, Any]]) -> str:
    """Mode by mode the figures before any experiment and after each."""
    rows = [row for name, mode in modes.items() for row in _rounds(MODE_WORDS[name], mode)]
    head = "mode | experiments | exact name first | truth in the set | names in the set | ties left | pairs, both right"
    asked = [[MODE_WORDS[name], *_asked_for(mode)] for name, mode in modes.items()]
    cost = "mode | cases that asked for one | minutes of rig time each | most a case | parted what they promised"
    return f"{_table(head, rows)}\n{_table(cost, asked)}" if any(mode["rounds"][1:] for mode in modes.values()) else ""


def _rounds(words: str, mode: Mapping[str, Any]) -> list[list[str]]:
    keys = ("exact_first", "truth_in_set", "set_size", "ties", "pairs_both")
    return [
        [words, str(number), *(figure_text(stage[key], "") for key in keys)]
        for number, stage in enumerate(mode["rounds"])
    ]


def _asked_for(mode: Mapping[str, Any]) -> list[str]:
    made = mode["experiments"]
    each = "-" if made["minutes"] is None else f"{made['minutes']:.1f}"
    return [_cell(made["asked"]), each, f"{made['minutes_most']:.1f}", _cell(mode["parted"])]


def _naive(naive: Mapping[str, Any]) -> str:
    figures = ("false_alarms", "detected", "class_first", "exact_first")
    rows = [[NAIVE_WORDS[name], *(_cell(modes["pressures"][key]) for key in figures)] for name, modes in naive.items()]
    return _table(" | ".join(["naive answer", *(key.replace("_", " ") for key in figures)]), rows)


def _table(head: str, rows: Sequence[Sequence[str]]) -> str:
    columns = head.count("|") + 1
    return "\n".join([f"| {head} |", "|---" * columns + "|", *(f"| {' | '.join(row)} |" for row in rows)]) + "\n"


def _cell(found: Any) -> str:
    """A rate as k of n, a share in per cent, nothing as a dash."""
    if isinstance(found, Mapping):
        return f"{found['k']} of {found['n']}"
    return "-" if found is None else f"{100 * found:.0f} %"
