"""The parts of the reference that are drawn from the code: `python docs/generated.py` puts them into the pages.

A page holds `<!-- generated: NAME -->` and `<!-- end -->`; what stands between is replaced. A test fails when a page is
behind.
"""

import ast
import dataclasses
import inspect
import json
import re
import textwrap
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import click

from drivers import catalog
from rig.app.compose import STAND_INS, device_class
from rig.cli.commands import cli
from rig.gap.priors import FactorLevels, fitted
from rig.gap.reference.patterns import ANGLE_NUISANCES, REGULATOR_NUISANCES, VALVE_NUISANCES, Nuisance
from rig.interfaces import abilities_of
from rig.qualify.faults.attacks import ATTACKS
from rig.qualify.faults.table import TABLE as FAULT_ROWS
from rig.qualify.figures import markdown
from rig.realtime.faults import EXPLANATIONS, Fault
from rig.realtime.guard import Limits
from rig.realtime.measures import Measures
from rig.realtime.state import TABLE, Event, State
from rig.rig_config import Safe
from rig.sample import WIRES, Flag, Phase
from rig.service.connections.protocol import COMMANDS

DOCS = Path(__file__).resolve().parent
_BLOCK = re.compile(r"(<!-- generated: (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)


def member_docs(kind: type) -> dict[str, str]:
    """Member -> the string below it in the source; one string may stand below several members."""
    body = ast.parse(textwrap.dedent(inspect.getsource(kind))).body[0]
    assert isinstance(body, ast.ClassDef)
    docs: dict[str, str] = {}
    waiting: list[str] = []
    for node in body.body:
        if isinstance(node, ast.Assign | ast.AnnAssign):
            target = node.targets[0] if isinstance(node, ast.Assign) else node.target
            waiting.append(ast.unparse(target))
        elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and waiting:
            docs |= dict.fromkeys(waiting, " ".join(str(node.value.value).split()))
            waiting = []
    return docs


def table(head: str, rows: Iterator[list[str]]) -> str:
    """A Markdown table; `head` has its titles between bars."""
    titles = [title.strip() for title in head.split("|")]
    lines = [titles, ["---"] * len(titles), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def sample_fields() -> str:
    """Every field of a sample."""
    return table(
        "number | field | Protobuf type | unit | meaning",
        ([str(n), f"`{name}`", w.kind, w.unit, w.meaning] for n, (name, w) in enumerate(WIRES.items(), 1)),
    )


def flags() -> str:
    """Every flag of a sample."""
    docs = member_docs(Flag)
    return table(
        "bit | value | flag | meaning",
        ([str(n), str(f.value), f"`{f.name}`", docs[f.name]] for n, f in enumerate(Flag)),
    )


def phases() -> str:
    """Every phase of an experiment."""
    return table("value | phase", ([str(p.value), f"`{p.name}`"] for p in Phase))


def state_diagram() -> str:
    """The state table as a diagram. A fault is possible everywhere, and drawn once for each state that it leaves."""
    moves = [
        f"    {state.name} --> {to.name}: {event.value}\n" for (state, event), to in TABLE.items() if state is not to
    ]
    return f"```mermaid\nstateDiagram-v2\n    [*] --> {State.DISARMED.name}\n{''.join(moves)}```\n"


def states() -> str:
    """Every state and what is possible in it."""
    docs = member_docs(State)
    possible = {s: [e.value for e in Event if (s, e) in TABLE and e is not Event.FAULT] for s in State}
    rows = ([str(s.value), s.name, docs[s.name], ", ".join(possible[s])] for s in State)
    return table("value | state | what the loop does | possible", rows)


def faults() -> str:
    """Every fault with cause and hint."""
    return table(
        "code | fault | cause | what to do", ([str(f.value), f"`{f.name}`", *EXPLANATIONS[f]] for f in Fault if f)
    )


def settings(kind: type[Any]) -> str:
    """The keys of a config section."""
    docs = member_docs(kind)
    return table(
        "key | default | unit | allowed | meaning",
        ([*_setting(f), docs.get(f.name, "")] for f in dataclasses.fields(kind)),
    )


def _setting(item: Any) -> list[str]:
    default = list(item.default) if isinstance(item.default, tuple) else item.default
    shown = str(default).lower() if isinstance(default, bool) else f"{default}"
    allowed = f"{item.metadata['low']:g} .. {item.metadata['high']:g}" if item.metadata else "true, false"
    return [f"`{item.name}`", shown, item.metadata.get("unit", ""), allowed]


def commands() -> str:
    """Every command of the control protocol."""
    rows = (
        [
            f"`{name}`",
            ", ".join(f"`{key}`" for key in command.arguments),
            "yes" if command.looking else "",
            command.meaning,
        ]
        for name, command in COMMANDS.items()
    )
    return table("command | arguments | over the network | what", rows)


def _options(command: click.Command, name: str = "") -> Iterator[tuple[str, click.Option]]:
    """Every option of the command and of those below it, with the command that has it."""
    yield from ((name, param) for param in command.params if isinstance(param, click.Option) and not param.hidden)
    if isinstance(command, click.Group):
        context = click.Context(command)
        for item in command.list_commands(context):
            inner = command.get_command(context, item)
            assert inner is not None
            yield from _options(inner, f"{name} {item}".strip())


def _taken(option: click.Option) -> str:
    """What stands behind an option, as its help has it."""
    if option.is_flag:
        return ""
    if isinstance(option.type, click.Choice):
        return ", ".join(map(str, option.type.choices))
    return f"`{option.metavar}`" if option.metavar else option.type.name.removesuffix(" range")


def options() -> str:
    """Every option of every command, by its name."""
    found: dict[str, list[tuple[str, click.Option]]] = {}
    for command, option in _options(cli):
        found.setdefault(", ".join(f"`{name}`" for name in (*option.opts, *option.secondary_opts)), []).append(
            (command, option)
        )
    return table(
        "option | takes | of the commands",
        (
            [
                name,
                "; ".join(dict.fromkeys(filter(None, (_taken(option) for _, option in found[name])))),
                ", ".join(command for command, _ in found[name] if command) or "all",
            ]
            for name in sorted(found)
        ),
    )


def device_kinds() -> str:
    """Every kind of device: the drivers, then what stands for hardware."""
    return table(
        "kind | what | hardware | clock | second path",
        (
            [
                f"`{kind}`",
                catalog.summary_of(made := device_class(kind, "the reference")).rstrip("."),
                "" if kind in STAND_INS else "yes",
                "real, virtual" if kind in STAND_INS else "real",
                "yes" if abilities_of(made).second_path else "none",
            ]
            for kind in (*catalog.KINDS, *STAND_INS)
        ),
    )


def fault_rows() -> str:
    """Every row of the fault table."""
    rows = (
        [
            row.name,
            row.done,
            " or ".join(f"`{cause}`" for cause in row.causes),
            f"{row.bound_ms:g} ms" if row.causes else "",
        ]
        for row in FAULT_ROWS
    )
    return table("fault | what is done | cause reported | bound", rows)


def attack_rows() -> str:
    """Every attack under which the emergency stop is timed."""
    return table("attack | what is done", ([attack.name, attack.done] for attack in ATTACKS))


def stored(name: str) -> dict[str, Any]:
    """What a command has written into docs/reference/NAME.json: `pamrig bench`, or a script of tests/."""
    found: dict[str, Any] = json.loads((DOCS / "reference" / f"{name}.json").read_text(encoding="utf-8"))
    return found


def library_figures() -> str:
    """What `python tests/library_figures.py` measured, each part with its date and machine."""
    parts = stored("library_figures").values()
    return "\n".join(f"{markdown.machine_line(part)}\n{markdown.table(part['figures'])}" for part in parts)


def real_summary() -> str:
    """What `python tests/real_sets.py` counted: a column a set."""
    sets = stored("real_records").values()
    names = dict.fromkeys(name for one in sets for name in one["summary"])
    head = " | ".join(["", *(f"{one['title']} ({one['date']})" for one in sets)])
    return table(head, ([name, *(one["summary"].get(name, "") for one in sets)] for name in names))


def real_rows() -> str:
    """Every change of every set, and what was said of it."""
    return "\n".join(
        f"### {one['title'][0].upper()}{one['title'][1:]}\n\n{table(' | '.join(one['head']), iter(one['rows']))}"
        for one in stored("real_records").values()
    )


def nuisances(named: Mapping[str, Nuisance], factor: str) -> str:
    """A factor's nuisances with their levels as shipped, by reference."""
    levels = {kind: getattr(one, factor).patterns for kind, one in fitted().levels.items()}

    def rows() -> Iterator[list[str]]:
        for name, one in named.items():
            told = [f"{level[name]:.3g}" if name in level else "" for level in levels.values()]
            yield [f"`{name}`", one.unit, one.meaning, one.elsewhere, *told]

    return table(f"level | unit | of what | elsewhere | {' | '.join(levels)}", rows())


def spreads() -> str:
    """What else a factor has, with its value as shipped."""
    meanings = member_docs(FactorLevels)
    levels = fitted().levels

    def rows() -> Iterator[list[str]]:
        for name in ("share", "even", "floor"):
            for factor in ("pressures", "angle"):
                told = [f"{getattr(getattr(one, factor), name):.3g}" for one in levels.values()]
                yield [f"`{factor}.{name}`", meanings[name], *told]

    return table(f"level | of what | {' | '.join(levels)}", rows())


BLOCKS: dict[str, Callable[[], str]] = {
    "sample_fields": sample_fields,
    "flags": flags,
    "phases": phases,
    "state_diagram": state_diagram,
    "states": states,
    "faults": faults,
    "commands": commands,
    "options": options,
    "device_kinds": device_kinds,
    "fault_rows": fault_rows,
    "attack_rows": attack_rows,
    "valve_nuisances": lambda: nuisances(VALVE_NUISANCES | REGULATOR_NUISANCES, "pressures"),
    "angle_nuisances": lambda: nuisances(ANGLE_NUISANCES, "angle"),
    "spreads": spreads,
    "safe": lambda: settings(Safe),
    "limits": lambda: settings(Limits),
    "realtime": lambda: settings(Measures),
    "machine": lambda: markdown.machine_line(stored("figures")),
    "figures": lambda: markdown.sections(stored("figures")),
    "library_figures": library_figures,
    "real_summary": real_summary,
    "real_rows": real_rows,
}
"""Name of a block -> what belongs into it."""


def filled(text: str) -> str:
    """A page with every generated block as it should be."""
    return _BLOCK.sub(lambda found: f"{found[1]}{BLOCKS[found[2]]()}{found[3]}", text)


def pages() -> list[Path]:
    """The pages that hold generated blocks."""
    return [path for path in sorted(DOCS.rglob("*.md")) if _BLOCK.search(path.read_text(encoding="utf-8"))]


if __name__ == "__main__":
    for page in pages():
        page.write_text(filled(page.read_text(encoding="utf-8")), encoding="utf-8")
