"""The public API: its list of names, that all of it is typed and documented, and what an import loads."""

import importlib
import inspect
import subprocess
import sys
from pathlib import Path

import pamrig

PUBLIC = {
    "CheckFailed", "Client", "Comparison", "ConfigError", "Diagnosis", "EnvelopeError", "Error", "Identified", "Model",
    "ModelError", "Picture", "Record", "RecordError", "Records", "Replay", "Rig", "Runs", "StateError", "Validation",
    "compare", "diagnose", "identify", "load_model", "load_rig", "read", "replay", "run", "save_model", "simulate",
    "simulated_rig", "validate",
}  # fmt: skip
"""What other people's code may rely on: a name that goes away, or changes its meaning, needs a new major version."""
RESULTS = {"Comparison", "Diagnosis", "Identified", "Record", "Records", "Replay", "Runs", "Validation"}
FOLDER = Path(pamrig.__file__).parent


def test_the_list_of_public_names() -> None:
    assert set(pamrig.__all__) == PUBLIC
    assert pamrig.__all__ == sorted(pamrig.__all__)
    assert set(dir(pamrig)) == PUBLIC


def test_every_name_is_there_and_says_what_it_is() -> None:
    for name in PUBLIC:
        assert inspect.getdoc(getattr(pamrig, name)), name
    assert pamrig.Error is importlib.import_module("rig.errors").RigError


def test_what_is_not_in_the_list_begins_with_an_underscore() -> None:
    modules = {path.stem for path in FOLDER.glob("*.py")} - {"__init__"}
    assert {name for name in modules if not name.startswith("_")} <= {"pytest"}


def test_a_result_shows_itself_and_draws_itself() -> None:
    for name in RESULTS:
        kind = getattr(pamrig, name)
        assert callable(kind._repr_html_), name
        assert kind.__repr__ is not object.__repr__, name
        assert callable(kind.plot), name


def test_it_is_typed() -> None:
    assert (FOLDER / "py.typed").exists()
    for name in PUBLIC:
        found = getattr(pamrig, name)
        if inspect.isfunction(found):
            unsaid = [p.name for p in inspect.signature(found).parameters.values() if p.annotation is p.empty]
            assert not unsaid, name
            assert inspect.signature(found).return_annotation is not inspect.Signature.empty, name


def test_importing_it_loads_nothing_heavy() -> None:
    script = "import sys, pamrig; print(' '.join(sys.modules))"
    done = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True)
    loaded = {name.split(".")[0] for name in done.stdout.split()}
    assert not loaded & {"numpy", "numba", "scipy", "matplotlib", "pandas", "xarray", "yaml", "cattrs", "click", "rich"}


def test_an_unknown_name_is_an_attribute_error() -> None:
    assert not hasattr(pamrig, "identfy")
