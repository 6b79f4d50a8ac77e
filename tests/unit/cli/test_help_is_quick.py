"""`pamrig --help` imports nothing heavy, and neither does the loop's side: which modules are loaded is checked, not
time."""

import importlib
import pickle
import subprocess
import sys
from pathlib import Path

import click
import pytest
from conftest import ROOT

from rig.app import compose, shipped
from rig.cli.commands import COMMANDS

HEAVY = {
    "numpy",
    "numba",
    "scipy",
    "matplotlib",
    "pandas",
    "pyarrow",
    "jinja2",
    "plotext",
    "cmaes",
    "nptdms",
    "dask",
    "foxglove",
}
NOT_FOR_HELP = HEAVY | {
    "yaml",
    "cattrs",
    "rich",
    "mcap",
    "google",
    "nifpga",
    "pymodbus",
    "serial",
    "asyncio",
    "multiprocessing",
}


def loaded_by(code: str) -> set[str]:
    """Top-level names of all modules that are loaded after `code`, in a fresh interpreter."""
    script = f"import sys\n{code}\nprint('\\n' + ' '.join(sys.modules))"
    done = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True)
    return {name.split(".")[0] for name in done.stdout.splitlines()[-1].split()}


def test_help_loads_click_and_our_table_only() -> None:
    code = "from rig.cli.commands import cli\ntry: cli.main(['--help'])\nexcept SystemExit: pass"
    loaded = loaded_by(code)
    assert "click" in loaded
    assert not loaded & NOT_FOR_HELP


def test_the_real_time_side_loads_the_standard_library_only() -> None:
    modules = sorted(f"rig.realtime.{path.stem}" for path in (ROOT / "rig" / "realtime").glob("[a-z]*.py"))
    loaded = loaded_by("\n".join(f"import {name}" for name in modules))
    foreign = {name for name in loaded if name not in sys.stdlib_module_names and not name.startswith("_")}
    assert foreign <= {"rig", "sitecustomize", "usercustomize", "sys"}
    assert not loaded & {"logging", "asyncio"}


def test_the_loop_s_process_loads_nothing_compiled_that_the_controller_lacks() -> None:
    loaded = loaded_by(
        "import rig.app.loop_process, hil.bench, rig.service.records.recorder\nfrom drivers import catalog"
    )
    assert not loaded & HEAVY


def test_loop_and_watchers_load_nothing_that_files_are_written_with() -> None:
    """Each is a process of its own, and the rig waits for all of them when it is armed."""
    assert not loaded_by("import rig.app.loop_process, hil.bench") & {"google", "mcap"}
    assert {"google", "mcap"} <= loaded_by("import rig.service.records.recorder")


def test_who_expands_sweeps_loads_nothing_of_who_asks() -> None:
    assert not loaded_by("import rig.service.queue.expander") & {"asyncio", "email"}


@pytest.mark.parametrize("rig", ["all_modbus", "paper_myrio", "serial_modbus"])
def test_loop_and_watchers_are_handed_the_rig_as_it_was_loaded(rig: str, tmp_path: Path) -> None:
    """They read no YAML, check no settings, and load nothing of who commands them."""
    loaded = compose.load(shipped.configs() / "rigs" / f"{rig}.yaml")
    (tmp_path / "rig").write_bytes(pickle.dumps(loaded))
    code = f"""import pickle, rig.app.loop_process
from rig.app.watcher_process import outside
with open({str(tmp_path / "rig")!r}, "rb") as told:
    outside(pickle.load(told))"""
    not_for_them = {"cattrs", "yaml", "email"} | ({"asyncio"} if "modbus" not in rig else set())  # pymodbus has it
    assert not loaded_by(code) & not_for_them


def test_no_command_loads_heavy_packages_before_it_is_called() -> None:
    modules = sorted({where.split(":")[0] for where, _ in COMMANDS.values()})
    assert not loaded_by("\n".join(f"import {name}" for name in modules)) & HEAVY


def test_a_diagnosis_loads_nothing_that_plans_sessions() -> None:
    """Half a second of its way to an answer, once: only a recommended sweep asks what the rig allows."""
    code = "rig.gap.diagnosis, rig.app.gap.sweep_envelope, rig.app.gap.campaign"
    found = "\nprint(sorted({'scipy.special', 'rig.app.gap.calibrating', 'rig.app.gap.planning'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", f"import sys, {code}{found}"], check=True, capture_output=True)
    assert done.stdout.strip() == b"[]"


def test_the_table_of_commands_is_complete_and_true() -> None:
    for name, (where, line) in COMMANDS.items():
        module, attribute = where.split(":")
        command = getattr(importlib.import_module(module), attribute)
        assert isinstance(command, click.Command), name
        assert line.endswith((".", "?"))
