"""The wheel: what is in it, and that it works away from the checkout, with the configs it brings."""

import json
import os
import shutil
import subprocess
import sys
import sysconfig
import venv
import zipfile
from pathlib import Path

import pytest
from conftest import ROOT


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A wheel built from a copy of the tree, so that the build leaves nothing behind here."""
    folder = tmp_path_factory.mktemp("wheel")
    for part in ("rig", "drivers", "hil", "configs"):
        shutil.copytree(ROOT / part, folder / "tree" / part, ignore=shutil.ignore_patterns("__pycache__"))
    for part in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / part, folder / "tree")
    call = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder / "dist")]
    subprocess.run(call, cwd=folder / "tree", check=True, capture_output=True)
    (built,) = (folder / "dist").glob("*.whl")
    return built


@pytest.fixture(scope="module")
def elsewhere(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A fresh environment with the wheel; its dependencies are those of this one, without a network."""
    folder = tmp_path_factory.mktemp("elsewhere")
    venv.create(folder, with_pip=False, symlinks=True)
    python = folder / "bin" / "python"
    install = [
        sys.executable,
        "-m",
        "pip",
        "--python",
        str(python),
        "install",
        "-q",
        "--no-deps",
        "--no-index",
        str(wheel),
    ]
    subprocess.run(install, check=True, capture_output=True)
    site = next((folder / "lib").glob("python*/site-packages"))
    # a path file inside a path is not read, so the editable install of this checkout stays out
    (site / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n")
    bring_machine_code(site)
    return folder


def bring_machine_code(site: Path) -> None:
    """What is compiled already: the sources are the same, but numba knows them by the time they were written."""
    for made in (ROOT / "rig").rglob("__pycache__/*.nb[ic]"):
        kept = site / made.relative_to(ROOT)
        if kept.parent.parent.is_dir():
            kept.parent.mkdir(exist_ok=True)
            shutil.copy(made, kept)
    for source in (ROOT / "rig").rglob("*.py"):
        if (installed := site / source.relative_to(ROOT)).exists():
            os.utime(installed, ns=(source.stat().st_atime_ns, source.stat().st_mtime_ns))


def test_the_top_level_is_the_three_roots_and_the_public_package(wheel: Path) -> None:
    names = zipfile.ZipFile(wheel).namelist()
    top = {name.split("/")[0] for name in names}
    assert {name for name in top if not name.endswith(".dist-info")} == {"rig", "drivers", "hil", "pamrig"}
    assert len(top) == 5
    assert {"pamrig/__init__.py", "pamrig/py.typed"} <= set(names)
    assert not [name for name in names if name.startswith("rig/public")]


def test_the_editable_install_has_the_public_package_of_this_checkout() -> None:
    script = "import pamrig, rig; print(pamrig.__file__, rig.__file__)"
    done = subprocess.run([sys.executable, "-I", "-c", script], check=True, capture_output=True, text=True)
    public, private = map(Path, done.stdout.split())
    assert public == ROOT / "rig" / "public" / "pamrig" / "__init__.py"
    assert private == ROOT / "rig" / "__init__.py"


def test_the_configs_are_inside_and_nothing_of_the_workshop(wheel: Path) -> None:
    names = zipfile.ZipFile(wheel).namelist()
    assert {
        "rig/_configs/rigs/simulated.yaml",
        "rig/_configs/sweeps/paper.yaml",
        "rig/_configs/models/simulated.yaml",
    } <= set(names)
    assert not [
        name for name in names if "test" in name.split("/")[0] or "__pycache__" in name or name.endswith(".mcap")
    ]


def test_it_is_called_pamrig_and_brings_the_command(wheel: Path) -> None:
    files = zipfile.ZipFile(wheel)
    (metadata,) = (name for name in files.namelist() if name.endswith(".dist-info/METADATA"))
    assert "\nName: pamrig\n" in files.read(metadata).decode()
    (entry,) = (name for name in files.namelist() if name.endswith("entry_points.txt"))
    assert "pamrig = rig.cli.main:main" in files.read(entry).decode()


def test_it_runs_away_from_the_checkout_with_its_own_configs(elsewhere: Path, tmp_path: Path) -> None:
    script = "import rig, drivers, hil, pamrig; print(rig.__file__, pamrig.__file__)"
    where = subprocess.run(
        [elsewhere / "bin" / "python", "-c", script], cwd=tmp_path, check=True, capture_output=True, text=True
    )
    assert all(place.startswith(str(elsewhere)) for place in where.stdout.split())
    call = [str(elsewhere / "bin" / "pamrig"), "run", "quick", "--clock", "virtual", "--out", "records", "--json", "-"]
    done = subprocess.run(call, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    (run,) = json.loads(done.stdout)["runs"]
    assert run["valid"] is True
    assert (tmp_path / run["file"]).exists()


def test_a_laboratory_s_repository_runs_the_simulated_rig_in_its_own_ci(elsewhere: Path, tmp_path: Path) -> None:
    folder = tmp_path / "rig_in_ci"
    shutil.copytree(ROOT / "docs" / "examples" / "rig_in_ci", folder)
    call = [str(elsewhere / "bin" / "python"), "-m", "pytest", "-q", "-p", "no:cacheprovider"]
    done = subprocess.run(call, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "4 passed" in done.stdout
    lost = next(folder.rglob("*.mcap"))
    lost.unlink()
    again = subprocess.run([*call, "-k", "does_what_it_did"], cwd=folder, capture_output=True, text=True, check=False)
    assert again.returncode == 1
    assert "`pytest --pamrig-update` writes it" in again.stdout
