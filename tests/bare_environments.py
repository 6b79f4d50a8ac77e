"""Wheel and sdist in bare environments: `python tests/bare_environments.py [INTERPRETER ...] [--dist FOLDER]`.

Each interpreter gets an empty virtual environment, pip takes pamrig and its dependencies from the index, and the
commands of a first session are carried out away from the checkout. uvx and pipx start the command where they are on
the path. It needs the standard library, and hatchling where no `--dist` with a wheel and an sdist is given. It is no
test of the suite: it needs the network, and minutes.
"""

import argparse
import json
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TypeAlias

ROOT = Path(__file__).resolve().parent.parent
EXTRAS = "tables,frames,fmu,web,live,dask,metrics"
LOOSE = ("pytest", "nbclient", "ipykernel")
"""What a user has beside pamrig: a test runner, and what carries notebooks out."""
KINDS = ("wheel", "sdist", "extras")
Steps: TypeAlias = tuple[tuple[str, ...], ...]
SESSION: Steps = (
    ("pamrig", "--help"),
    ("pamrig", "run", "quick", "--clock", "virtual", "--out", "first"),
    ("pamrig", "validate", "simulated", "first"),
    ("pamrig", "gap", "diagnose", "--model", "simulated", "--log", "first", "--reference", "simulator"),
    ("python", "-c", "import pamrig; pamrig.read('first').plot().save('first.png')"),
)
"""What a first session calls; every one must end with status 0."""
BESIDE: Steps = (
    ("python", "-c", "import fmpy, foxglove, distributed, nptdms, prometheus_client, starlette, uvicorn, websockets"),
    ("python", "-c", "import pamrig; one = pamrig.read('first')[0]; one.to_pandas(); one.to_xarray()"),
    ("pamrig", "log", "export", "first", "-o", "tables", "--to", "parquet"),
    ("python", "-m", "pytest", "-q", "-p", "no:cacheprovider", "rig_in_ci"),
    ("python", "-c", "import nbclient, nbformat; nbclient.execute(nbformat.read('first_sweep.ipynb', 4))"),
)
"""What extras and other people's tools are for, after the session; beside the example repository and a notebook."""


def built(folder: Path) -> Path:
    """A wheel and an sdist of a copy of this tree, below `folder`."""
    tree = folder / "tree"
    for part in ("rig", "drivers", "hil", "configs"):
        shutil.copytree(ROOT / part, tree / part, ignore=shutil.ignore_patterns("__pycache__"))
    for part in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / part, tree)
    call([sys.executable, "-m", "hatchling", "build", "-d", str(folder / "dist")], tree)
    return folder / "dist"


def tried(interpreter: str, packages: list[str], session: Steps, folder: Path) -> Iterator[tuple[str, float]]:
    """Install packages in an environment of that interpreter and carry the session out: each step with its seconds.

    CalledProcessError when a step fails.
    """
    call([interpreter, "-m", "venv", "env"], folder)
    yield "install", call(["env/bin/python", "-m", "pip", "install", "-q", *packages], folder)
    shutil.copytree(ROOT / "docs/examples/rig_in_ci", folder / "rig_in_ci")
    shutil.copy(ROOT / "docs/notebooks/first_sweep.ipynb", folder)
    for number, words in enumerate(session, 1):
        yield f"{number} {' '.join(words[:3])[:60]}", call([str(folder / "env/bin" / words[0]), *words[1:]], folder)


def started(wheel: Path, folder: Path) -> Iterator[tuple[str, float]]:
    """The command by a launcher that makes the environment itself, for each that is on the path."""
    launchers = {"uvx": ["--from", str(wheel)], "pipx": ["run", "--spec", str(wheel)]}
    for name, words in launchers.items():
        if found := shutil.which(name):
            yield name, call([found, *words, "pamrig", "--help"], folder)


def call(words: list[str], where: Path) -> float:
    """Carry out a command; seconds it took. What a failing one said goes to stderr."""
    began_s = time.monotonic()
    done = subprocess.run(words, cwd=where, capture_output=True, text=True, check=False)
    if done.returncode:
        print(done.stdout, done.stderr, file=sys.stderr)
        done.check_returncode()
    return time.monotonic() - began_s


def main() -> None:
    """Print a line of JSON for everything that was tried."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("interpreters", nargs="*", default=[sys.executable])
    parser.add_argument("--dist", type=Path, help="folder with a wheel and an sdist, in place of building them")
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=KINDS, metavar="KIND", help=", ".join(KINDS))
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="pamrig-") as scratch:
        dist = given.dist.resolve() if given.dist else built(Path(scratch))
        (wheel,), (sdist,) = dist.glob("*.whl"), dist.glob("*.tar.gz")
        kinds = {
            "wheel": ([str(wheel)], SESSION),
            "sdist": ([str(sdist)], SESSION),
            "extras": ([f"{wheel}[{EXTRAS}]", *LOOSE], SESSION + BESIDE),
        }
        for interpreter in given.interpreters:
            for kind in given.kinds:
                with tempfile.TemporaryDirectory(prefix="pamrig-") as folder:
                    steps = dict(tried(interpreter, *kinds[kind], Path(folder)))
                told(interpreter, kind, steps)
        with tempfile.TemporaryDirectory(prefix="pamrig-") as folder:
            told("launchers", "wheel", dict(started(wheel, Path(folder))))


def told(interpreter: str, kind: str, steps: dict[str, float]) -> None:
    """One line of what was tried."""
    line = {"interpreter": interpreter, "what": kind, "seconds": {name: round(s, 1) for name, s in steps.items()}}
    print(json.dumps(line), flush=True)


if __name__ == "__main__":
    main()
