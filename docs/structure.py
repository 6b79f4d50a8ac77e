"""How the code is laid out, in numbers: `python docs/structure.py [REVISION ...]` counts the checkout, or revisions of
the repository beside each other, and prints tables. Source is read as text; the starts are processes.

Counted are rig, drivers and hil: files, lines and functions a room, the longest chain of imports, the largest fan-out,
circles, runs of lines that stand twice, and how often the way of a diagnosis comes back to a file that it has left.
"""

import ast
import io
import math
import os
import statistics
import subprocess
import sys
import tarfile
import tempfile
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator
from functools import cached_property
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).resolve().parent.parent
ROOMS: Final = ("rig", "drivers", "hil")
RUN: Final = 6
"""So many lines alike, one below the other, are a piece that stands twice; imports, comments and blank lines aside."""
STARTS: Final = 5
"""Starts of a command, of which the shortest processor time counts: what else the machine does only adds to it."""
DIAGNOSIS: Final = ("rig.gap.diagnosis", "diagnose")

Function = ast.FunctionDef | ast.AsyncFunctionDef


class Checkout:
    """The source below a folder: modules by name, with their syntax trees."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.files = {
            ".".join(path.relative_to(folder).with_suffix("").parts): path
            for room in ROOMS
            for path in sorted((folder / room).rglob("*.py"))
            if path.stat().st_size
        }
        self.trees = {name: ast.parse(path.read_text(encoding="utf-8")) for name, path in self.files.items()}

    def module_of(self, name: str) -> str | None:
        """The module that `name` is, or that holds it."""
        return next((known for known in (name, name.rpartition(".")[0]) if known in self.files), None)

    @cached_property
    def nodes(self) -> dict[str, list[ast.AST]]:
        """Module -> all that is in its tree, which takes longer to walk through than to look at."""
        return {name: list(ast.walk(tree)) for name, tree in self.trees.items()}

    @cached_property
    def named(self) -> dict[str, list[tuple[str, str]]]:
        """Module -> (name in it, what that stands for), wherever in the file it is imported."""
        return {name: list(_names(nodes)) for name, nodes in self.nodes.items()}

    @cached_property
    def imported(self) -> dict[str, dict[str, str]]:
        """Module -> name in it -> what that stands for."""
        return {name: dict(found) for name, found in self.named.items()}

    @cached_property
    def imports(self) -> dict[str, set[str]]:
        """Module -> modules that it imports, anywhere in it."""
        return {
            name: {found for _, full in named if (found := self.module_of(full)) and found != name}
            for name, named in self.named.items()
        }

    @cached_property
    def levels(self) -> dict[str, int]:
        """Module -> how many imports lie below it, one on the other; a module of a circle counts its circle once."""
        known: dict[str, int] = {}

        def level(name: str, above: frozenset[str]) -> int:
            if name not in known:
                below = [level(other, above | {name}) for other in self.imports[name] if other not in above]
                known[name] = 1 + max(below, default=-1)
            return known[name]

        return {name: level(name, frozenset()) for name in self.files}

    @cached_property
    def functions(self) -> dict[str, list[Function]]:
        """Module -> its functions and methods."""
        return {name: [node for node in nodes if isinstance(node, Function)] for name, nodes in self.nodes.items()}


def _names(nodes: Iterable[ast.AST]) -> Iterator[tuple[str, str]]:
    """(name here, what it stands for) of every import among them."""
    for each in nodes:
        if isinstance(each, ast.ImportFrom) and each.module and not each.level:
            yield from ((alias.asname or alias.name, f"{each.module}.{alias.name}") for alias in each.names)
        elif isinstance(each, ast.Import):
            yield from ((alias.asname or alias.name, alias.name) for alias in each.names)


def way(code: Checkout, start: tuple[str, str]) -> list[str]:
    """The modules that are passed from a function on, in the order of the source: each function called is followed
    where it is first called, and then the way is back where it came from. Calls of methods are not followed."""
    passed: list[str] = []
    seen: set[tuple[str, str]] = set()

    def follow(module: str, name: str) -> None:
        body = next((f for f in code.functions[module] if f.name == name), None)
        if body is None or (module, name) in seen:
            return
        seen.add((module, name))
        enter(module)
        for call in (node for node in ast.walk(body) if isinstance(node, ast.Call)):
            full = code.imported[module].get(_head(call.func), f"{module}.{_head(call.func)}")
            target = full + _tail(call.func)
            if (found := code.module_of(target)) and target != found:
                follow(found, target.rpartition(".")[2])
                enter(module)

    def enter(module: str) -> None:
        if not passed or passed[-1] != module:
            passed.append(module)

    follow(*start)
    return passed


def _head(call: ast.expr) -> str:
    return call.id if isinstance(call, ast.Name) else _head(call.value) if isinstance(call, ast.Attribute) else ""


def _tail(call: ast.expr) -> str:
    return f"{_tail(call.value)}.{call.attr}" if isinstance(call, ast.Attribute) else ""


def in_circles(code: Checkout) -> int:
    """Modules that import themselves by way of others."""

    def below(name: str) -> set[str]:
        found: set[str] = set()
        waiting = [name]
        while waiting:
            new = code.imports[waiting.pop()] - found
            found |= new
            waiting += new
        return found

    return sum(name in below(name) for name in code.files)


def twice(code: Checkout) -> int:
    """Lines of which RUN or more stand in the same order in two places."""
    places: dict[tuple[str, ...], list[tuple[str, int]]] = defaultdict(list)
    for name, path in code.files.items():
        lines = [line for text in path.read_text(encoding="utf-8").splitlines() if (line := text.strip())]
        lines = [line for line in lines if len(line) > 3 and not line.startswith(("#", "import ", "from "))]
        for k in range(len(lines) - RUN + 1):
            places[tuple(lines[k : k + RUN])].append((name, k))
    return len({(name, k + j) for found in places.values() if len(found) > 1 for name, k in found for j in range(RUN)})


def figures(code: Checkout) -> dict[str, str]:
    """What is counted -> as it is printed."""
    lines = {name: path.read_text(encoding="utf-8").count("\n") for name, path in code.files.items()}
    lengths = sorted((f.end_lineno or 0) - f.lineno + 1 for found in code.functions.values() for f in found)
    folders = Counter(path.parent.relative_to(code.folder).as_posix() for path in code.files.values())
    passed = way(code, DIAGNOSIS)
    deepest = max(code.levels[name] for name in code.files if name.startswith("rig.gap"))
    fan_out = {name: len(found) for name, found in code.imports.items()}
    widest = max(fan_out, key=fan_out.__getitem__)
    crowded = ", ".join(f"{folder} {count}" for folder, count in folders.most_common(3))
    return {
        "files, lines": f"{len(lines)}, {sum(lines.values())}",
        "lines a file, median and longest": f"{statistics.median(lines.values()):g}, {max(lines.values())}",
        "functions; lines of them, median, 90 %, longest": f"{len(lengths)}; {statistics.median(lengths):g}, "
        f"{lengths[int(0.9 * len(lengths))]}, {lengths[-1]}",
        "fullest folders (files)": crowded,
        "lines of rig/cli": str(sum(count for name, count in lines.items() if name.startswith("rig.cli"))),
        "levels of imports, all; rig.gap": f"{max(code.levels.values())}; {deepest}",
        "modules in circles of imports": str(in_circles(code)),
        "largest fan-out": f"{fan_out[widest]} ({widest})",
        f"lines that stand twice (runs of {RUN})": str(twice(code)),
        "way of a diagnosis: files, stays, returns": f"{len(set(passed))}, {len(passed)}, "
        f"{len(passed) - len(set(passed))}",
    }


def rooms(code: Checkout) -> dict[str, str]:
    """Room -> files, lines and functions in it; `rig` by its own rooms."""
    counts: dict[str, list[int]] = defaultdict(lambda: [0, 0, 0])
    for name, path in code.files.items():
        parts = path.relative_to(code.folder).parts
        room = parts[0] if parts[0] != "rig" else "rig" if len(parts) == 2 else f"rig/{parts[1]}"
        found = counts[room]
        found[0] += 1
        found[1] += path.read_text(encoding="utf-8").count("\n")
        found[2] += len(code.functions[name])
    return {room: ", ".join(map(str, found)) for room, found in sorted(counts.items())}


def commands(code: Checkout) -> list[str]:
    """The commands of the table in the source."""
    for node in ast.walk(code.trees["rig.cli.commands"]):
        if (
            isinstance(node, ast.Assign)
            and ast.unparse(node.targets[0]) == "COMMANDS"
            and isinstance(node.value, ast.Dict)
        ):
            return [key.value for key in node.value.keys if isinstance(key, ast.Constant)]
    return []


def start_s(folder: Path, words: list[str]) -> float:
    """Processor time until the help of a command stands there."""
    environment = {**os.environ, "PYTHONPATH": str(folder)}
    call = [sys.executable, "-m", "rig.cli.main", *words, "--help"]
    process = subprocess.Popen(call, cwd=folder, env=environment, stdout=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(f"{' '.join(call)} ended with {process.returncode}")
    return used.ru_utime + used.ru_stime


def starts(code: list[Checkout]) -> list[dict[str, str]]:
    """For each checkout: command -> the shortest processor time of its help, ms. They take turns, so that what else
    the machine does meets all of them."""
    asked = [{"pamrig": [], **{f"pamrig {name}": [name] for name in commands(each)}} for each in code]
    shortest: list[dict[str, float]] = [{} for _ in code]
    for name in dict.fromkeys(name for words in asked for name in words):
        for _ in range(STARTS):
            for each, words, found in zip(code, asked, shortest, strict=True):
                if name in words:
                    found[name] = min(found.get(name, math.inf), start_s(each.folder, words[name]))
    return [{name: f"{1e3 * seconds:.0f}" for name, seconds in found.items()} for found in shortest]


def table(title: str, columns: list[dict[str, str]], names: list[str]) -> str:
    """A Markdown table: a row for everything that any column has."""
    rows = list(dict.fromkeys(key for column in columns for key in column))
    lines = [[title, *names], ["---"] * (len(names) + 1)]
    lines += [[row, *(column.get(row, "") for column in columns)] for row in rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def extracted(revision: str, folder: Path) -> Path:
    """The source of a revision, below `folder`."""
    packed = subprocess.run(["git", "archive", revision, *ROOMS], cwd=ROOT, capture_output=True, check=True).stdout
    with tarfile.open(fileobj=io.BytesIO(packed)) as archive:
        archive.extractall(folder / revision, filter="data")
    return folder / revision


def main() -> None:
    """Three tables: the whole, the rooms, the starts."""
    revisions = sys.argv[1:]
    with tempfile.TemporaryDirectory() as folder:
        places = [extracted(revision, Path(folder)) for revision in revisions] or [ROOT]
        code = [Checkout(place) for place in places]
        names = revisions or ["now"]
        print(table("", [figures(each) for each in code], names))
        print(table("room: files, lines, functions", [rooms(each) for each in code], names))
        print(table("processor time of `--help`, ms", starts(code), names))


if __name__ == "__main__":
    main()
