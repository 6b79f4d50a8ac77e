"""Every example in the docstrings of the public API runs, in one folder with two days of records."""

import doctest
import importlib
from pathlib import Path

import pamrig
import pytest

MODULES = ["pamrig", *(f"pamrig.{path.stem}" for path in sorted(Path(pamrig.__file__).parent.glob("_[a-z]*.py")))]


@pytest.fixture(scope="module")
def days(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the records that the examples speak of."""
    folder = tmp_path_factory.mktemp("days")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        pamrig.run("quick", pamrig.simulated_rig(seed=7), out="first")
        pamrig.run("quick", pamrig.simulated_rig({"valve_lag": {"tau_s": 0.04}}, seed=8), out="worn")
    return folder


def examples() -> list[doctest.DocTest]:
    finder = doctest.DocTestFinder()
    found = [test for name in MODULES for test in finder.find(importlib.import_module(name), globs={"pamrig": pamrig})]
    return [test for test in found if test.examples]


def test_there_are_examples_of_every_function() -> None:
    told = " ".join(example.source for test in examples() for example in test.examples)
    functions = [name for name in pamrig.__all__ if name[0].islower()]
    assert not [name for name in functions if f"pamrig.{name}(" not in told]


@pytest.mark.parametrize("example", examples(), ids=lambda example: example.name)
def test_an_example_runs(example: doctest.DocTest, days: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for day in days.iterdir():
        (tmp_path / day.name).symlink_to(day)
    if example.name == "pamrig":  # it makes the first of the two itself
        (tmp_path / "first").unlink()
    monkeypatch.chdir(tmp_path)
    failed, _ = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE).run(
        example, clear_globs=False
    )
    assert not failed
