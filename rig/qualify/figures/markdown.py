"""The page of figures: Markdown of what `pamrig bench --json` wrote, dated and with the machine."""

from collections.abc import Iterator, Mapping
from typing import Any

from rig.qualify.figures.comparison import figures_of
from rig.qualify.figures.rounds import Figures, Row

HEAD = "figure | measured | beside, in the same run | ratio | limit, and how close | goal"


def machine_line(results: Mapping[str, Any]) -> str:
    """When and on what the figures were measured, and whether the machine had other work."""
    one = results["machine"]
    where = f"{one['cpu']}, {one['cores']} cores, {one['system']}, Python {one['python']}"
    busy = f"; other work kept {one['load']:g} processors busy" if one.get("load", 0.0) >= 1.0 else ""
    return f"Measured {one.get('date', 'at an unknown date')} on {where}{busy}.\n"


def sections(results: Mapping[str, Any]) -> str:
    """Every benchmark's table under a title of its own."""
    return "\n".join(f"### `pamrig bench {name}`\n\n{table(figures)}" for name, figures in figures_of(results).items())


def table(figures: Figures) -> str:
    """One benchmark's figures; below them why some stand alone."""
    lines = [HEAD.split(" | "), ["---"] * 6, *(_cells(name, row) for name, row in figures.items())]
    reasons = dict.fromkeys(_reasons(figures))
    remarks = "".join(f"\nWithout a peer or a limit: {reason}.\n" for reason in reasons)
    return "".join(f"| {' | '.join(line)} |\n" for line in lines) + remarks


def _reasons(figures: Figures) -> Iterator[str]:
    for row in figures.values():
        if row.get("why"):
            yield str(row["why"])


def _cells(name: str, row: Row) -> list[str]:
    return [name, _measured(row), _peer(row), _ratio(row), _limit(row), _goal(row)]


def _measured(row: Row) -> str:
    aside = []
    if "value_low" in row:
        aside.append(f"{_number(row['value_low'])} to {_number(row['value_high'])}")
    elif "low" in row:
        aside.append(f"{_number(row['low'])} to {_number(row['high'])}")
    if "of" in row:
        aside.append(f"of {row['of']}")
    return f"{_number(row['value'])} {row['unit']}" + (f" ({', '.join(aside)})" if aside else "")


def _peer(row: Row) -> str:
    return f"{row['peer']}: {_number(row['peer_value'])}" if row.get("peer") else ""


def _ratio(row: Row) -> str:
    if row.get("ratio") is None:
        return ""
    around = f" ({_number(row['ratio_low'])} to {_number(row['ratio_high'])})" if "ratio_low" in row else ""
    return f"{_number(row['ratio'])}{around}"


def _limit(row: Row) -> str:
    """The limit in the figure's own unit, and how many times farther the figure is."""
    if row.get("limit_value") is None:
        return ""
    return f"{row['limit']}: {_number(row['limit_value'])}; {_number(row['value'] / row['limit_value'])} of it"


def _goal(row: Row) -> str:
    if row.get("goal") is None:
        return ""
    higher = row.get("better") == "higher"
    missed = row["value"] < row["goal"] if higher else row["value"] > row["goal"]
    return f"{_number(row['goal'])}{', **missed**' if missed else ''}"


def _number(value: Any) -> str:
    return "?" if value is None else f"{value:.3g}" if abs(value) < 1000 else f"{value:,.0f}".replace(",", " ")
