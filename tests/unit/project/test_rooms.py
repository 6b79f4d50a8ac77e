"""The rules of the rooms hold: import-linter's contracts, and what it cannot see."""

import ast
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from conftest import ROOT

SOURCES = sorted(path for room in ("rig", "drivers", "hil") for path in (ROOT / room).rglob("*.py"))
REACHES = ("setattr", "getattr", "delattr", "patch", "object")
TESTS = sorted((ROOT / "tests").rglob("*.py"))
TOP = {"rig", "drivers", "hil", "tests", "configs", "logs", "docs", ".ci", ".github"}
TOP |= {
    "pyproject.toml",
    "requirements.lock",
    "requirements-test.lock",
    "Makefile",
    ".gitignore",
    ".pre-commit-config.yaml",
}
TOP |= {"README.md", "CHANGELOG.md", "CONTRIBUTING.md", "LICENSE"}
TEST_MODULES = {path.stem for path in TESTS if path.name.startswith("test_")}


def test_the_contracts_hold() -> None:
    lint = Path(sys.executable).with_name("lint-imports")
    done = subprocess.run([lint, "--no-cache"], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


def test_every_module_right_in_rig_stands_in_the_contracts() -> None:
    """One that a list of modules leaves out is held to nothing, and no contract says so."""
    lint = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]
    contracts = {contract["name"]: contract for contract in lint["contracts"]}
    inside = [path.relative_to(ROOT) for path in SOURCES if path.is_relative_to(ROOT / "rig")]
    modules = {f"rig.{path.parts[1].removesuffix('.py')}" for path in inside} - {"rig.__init__", "rig.public"}
    floors = {name for line in contracts["Floors run one way"]["layers"] for name in line.split(" : ")}
    assert modules - floors == set()
    below_the_roof = modules - {"rig.app", "rig.qualify", "rig.cli"}
    assert below_the_roof == set(contracts["Only the roof knows drivers and stand-ins"]["source_modules"])


def test_nothing_that_somebody_tried_out_is_kept_at_the_top() -> None:
    if not (ROOT / ".git").exists() or shutil.which("git") is None:
        pytest.skip("no checkout, or no git: what is kept is known to it alone")
    listed = ["git", "-c", "safe.directory=*", "ls-files"]  # a checkout may be another user's
    kept = subprocess.run(listed, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    assert {path.split("/")[0] for path in kept.splitlines()} == TOP


@pytest.mark.parametrize("room", ["rig", "drivers", "hil"])
def test_every_file_and_every_folder_says_what_it_holds(room: str) -> None:
    """Of a folder its `__init__.py` says it; 56 of them were empty."""
    assert not [path for path in SOURCES if path.is_relative_to(ROOT / room) and not docstring(path)]


def test_tests_have_one_conftest() -> None:
    """Tests import what it holds by its name: a second one would stand before it for every file read after."""
    assert [path.relative_to(ROOT).as_posix() for path in TESTS if path.name == "conftest.py"] == ["tests/conftest.py"]


def test_no_file_is_a_heap() -> None:
    assert not [(path.name, lines) for path in SOURCES if (lines := len(path.read_text().splitlines())) > 400]


def test_below_the_roof_nobody_asks_whether_it_is_a_simulation() -> None:
    words = ("is_simulated", "if simulation", "if simulated", "if virtual")
    roof = [ROOT / "rig" / room for room in ("app", "cli", "qualify", "public")]
    below = [path for path in SOURCES if not any(path.is_relative_to(room) for room in roof)]
    assert not [path for path in below if any(word in path.read_text() for word in words)]


def docstring(path: Path) -> str | None:
    return ast.get_docstring(ast.parse(path.read_text()))


def imported(text: str) -> set[str]:
    """The last names of the modules that a file imports, and what it takes out of packages."""
    found = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            found |= {name.name.rpartition(".")[2] for name in node.names}
        elif isinstance(node, ast.ImportFrom):
            found |= {(node.module or "").rpartition(".")[2], *(name.name for name in node.names)}
    return found


def privates(text: str) -> set[str]:
    """Private names that a file reaches for in others: imported, by a string in `setattr` and the like, or by a
    keyword that somebody sets. As attributes the linter sees them."""
    found = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ImportFrom):
            found |= {name.name for name in node.names if private(name.name)}
        elif isinstance(node, ast.Call):
            called = getattr(node.func, "attr", getattr(node.func, "id", ""))
            words = [arg.value for arg in node.args if isinstance(arg, ast.Constant) and called in REACHES]
            found |= {word for word in (*words, *(given.arg for given in node.keywords)) if private(word)}
    return found


def private(name: object) -> bool:
    return isinstance(name, str) and name.startswith("_") and not name.startswith("__")


def test_no_test_imports_from_another() -> None:
    assert not [path.name for path in TESTS if imported(path.read_text()) & TEST_MODULES]


def test_no_test_reaches_for_private_names() -> None:
    assert not {path.name: found for path in TESTS if (found := privates(path.read_text()))}


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("from test_rooms import docstring", set()),
        ("from rig.app.runs.runner import _watch", {"_watch"}),
        ("monkeypatch.setattr(runner, '_watch', stopped)", {"_watch"}),
        ("monkeypatch.setattr(runner, 'watch', stopped)", set()),
        ("short(safety, _QUIET_S=0.5)", {"_QUIET_S"}),
    ],
)
def test_a_test_that_does_is_seen(text: str, found: set[str]) -> None:
    assert privates(text) == found
    assert bool(imported(text) & TEST_MODULES) is ("test_rooms" in text)


def test_beside_the_folders_of_tests_stand_only_programs_to_start() -> None:
    """What tests share stands in tests/support."""
    beside = [path for path in (ROOT / "tests").glob("*.py") if path.name != "conftest.py"]
    assert beside
    assert not [path.name for path in beside if '__name__ == "__main__"' not in path.read_text()]
