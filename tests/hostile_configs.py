"""Configs made to hang, fill or break whoever reads them, by a seed: rigs, sweeps, references, models, settings,
register maps, calibrations, mappings of columns, priors.

    python tests/hostile_configs.py --seconds 3600 --seed 1

Each is one of the project's own files in which something was changed, as data or as text, and must end, within a time
of its own, as a config or as one line that says what is wrong.
"""

import contextlib
import copy
import json
import random
import shutil
import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import yaml
from support import hostile_work

from drivers.calibration import parse_all
from drivers.modbus_io.maps import load_map
from rig.app import compose, inventory, shipped
from rig.app.devices import calibrating
from rig.app.runs.replaying import load_gate
from rig.config import load, read_yaml
from rig.errors import RigError
from rig.gap.priors import PRIORS, Fitted
from rig.log.foreign.mapping import load_mapping
from rig.model.chain import Chain
from rig.model.parameters import load_model
from rig.realtime.clock import MonotonicClock
from rig.service import settings
from rig.service.queue.expander import plans_of

ALLOWED_S = 30.0
ALLOWED_S_A_MB = 60.0
ALLOWED_SWEEP_S = 150.0
"""A day of set-points, which is as much as a sweep may hold, on a machine that does other work too."""
STEPS = 20
"""Of a simulator whose model could be read."""
CALIBRATION = """\
valve_1: {points: [[0.1, 0.102], [0.3, 0.301], [0.5, 0.5]], form: line, reference: gauge, reference_uncertainty: 0.001}
angle: {points: [[0.2, -30.0], [0.5, 0.0], [0.8, 30.0]], form: line}
"""
MAPPING = """\
columns:
  t_s: {source: Time}
  dp_cmd_mpa: {source: Valve, scale: 0.001, offset: 0.1}
  angle_deg: {source: Angle, unit: rad}
separator: ';'
decimal: ','
facts: {session: day1, p0_mpa: 0.2}
"""
SETTINGS = """\
keep_gb: 5.0
keep_days: 30
group: ''
live: {port: 8765}
view: {port: 0}
web: {port: 8080, sweeps: [.]}
"""
GATE = "angle_deg: 0.001\np1_mpa: 0.01\n"
LEAVES: list[Any] = [
    None, True, -1, 0, 1, 3.7, 1e-300, 1e300, -1e9, float("nan"), float("inf"), 10**400, 2**63, "", "x", "\x1b[2J",
    "1e999", "../../../etc/passwd", "/dev/zero", "\0", "\u202e", "x" * 5000, [], {}, [[]], [1, "x"], {"x": 1},
    [0.1] * 3000, list(range(300)), "2020-01-01", "0.2 MPa", [None], {"": None}, 1e-9, 86400, 2147483647,
]  # fmt: skip
TRAPS = [
    "a: &a [x, x]\nb: &b [*a, *a]\nc: &c [*b, *b]\n",
    "&a [*a]\n",
    "- " * 3000 + "x\n",
    "[" * 3000,
    "{" * 800 + "}" * 800,
    "? [a]\n: b\n",
    "<<: {name: x}\n",
    "!!python/object/apply:os.system ['true']\n",
    "%YAML 9.9\n---\n",
    "--- a\n--- b\n",
    "\ufeff",
    "\t",
    "x: |\n  " + "y" * 9000 + "\n",
    "x: 'unended",
    "x: 1\nx: 2\n",
    "é: \u2028\n",
]


def _rig(path: Path) -> None:
    rig = compose.load(path)
    inventory.inventory(rig)
    compose.make_device(rig, MonotonicClock())


def _model(path: Path) -> None:
    model = load_model(path)
    if model.muscle.kind != "external":
        chain = Chain(model)
        for _ in range(STEPS):
            chain.step(0.3, 0.2)


def _settings(path: Path) -> None:
    settings.load_settings(path)


def _calibration(path: Path) -> None:
    parse_all(read_yaml(path), str(path))


def _sweep(path: Path) -> None:
    with contextlib.suppress(MemoryError):  # the planner's process, whose memory is bounded, answers that in one line
        plans_of(path, compose.load(None))


def _mapping(path: Path) -> None:
    load_mapping(path)


def _levels(path: Path) -> None:
    load(path, Fitted)


def _gate(path: Path) -> None:
    load_gate(path)


def _map(path: Path) -> None:
    load_map(path)


def _points(path: Path) -> None:
    calibrating.write(path.with_name("out.calibration.yaml"), calibrating.read_points(path), "here")


Reader = Callable[[Path], None]


def sources(folder: Path) -> list[tuple[Path, Reader]]:
    """The project's own files, copied to `folder`, and who reads each."""
    shutil.copytree(shipped.configs(), folder, dirs_exist_ok=True)
    by_folder: dict[str, Reader] = {
        "rigs": _rig, "sweeps": _sweep, "references": _sweep, "models": _model, "modbus": _map, "imports": _mapping,
    }  # fmt: skip
    found = [(path, read) for name, read in by_folder.items() for path in sorted((folder / name).glob("*.yaml"))]
    texts = {"points": CALIBRATION, "mapping": MAPPING, "settings": SETTINGS, "gate": GATE}
    readers: dict[str, Reader] = {"points": _points, "mapping": _mapping, "settings": _settings, "gate": _gate}
    for name, text in texts.items():
        (folder / f"{name}.yaml").write_text(text, encoding="utf-8")
        found.append((folder / f"{name}.yaml", readers[name]))
    found.append((folder / "points.yaml", _calibration))
    shutil.copy(PRIORS, folder / "priors.yaml")
    return [*found, (folder / "daemon.yaml", _settings), (folder / "priors.yaml", _levels)]


def leaf(draw: random.Random) -> Any:
    """One of LEAVES, which stay as they are."""
    return copy.deepcopy(draw.choice(LEAVES))


def places(value: Any) -> Iterator[tuple[Any, Any]]:
    """Every container of a document with every key or index of it."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, item in list(items):
        yield value, key
        yield from places(item)


def changed_data(raw: Any, draw: random.Random) -> Any:
    """A document with a few values replaced, moved, doubled or taken out."""
    for _ in range(draw.choice([1, 1, 2, 5])):
        found = list(places(raw))
        if not found:
            return leaf(draw)
        holder, key = draw.choice(found)
        match draw.randrange(5):
            case 0 | 1:
                holder[key] = leaf(draw)
            case 2:
                del holder[key]
            case 3:
                other, place = draw.choice(found)
                if place in other if isinstance(other, dict) else place < len(other):
                    holder[key] = json.loads(json.dumps(other[place], default=str))
            case 4:
                if isinstance(holder, dict):
                    holder[draw.choice(["x", "", "name", "kind", 7, None, "p0_mpa"])] = leaf(draw)
                else:
                    holder.extend(holder[: draw.choice([1, 2, 50])])
    return raw


def changed_text(text: str, draw: random.Random) -> str:
    """The text with lines doubled, cut, swapped, or a trap in it."""
    lines = text.splitlines(keepends=True) or [""]
    for _ in range(draw.choice([1, 2, 4])):
        at = draw.randrange(len(lines))
        match draw.randrange(5):
            case 0:
                lines[at] = draw.choice(TRAPS)
            case 1:
                lines[at] = lines[at][: draw.randrange(len(lines[at]) + 1)]
            case 2:
                lines.insert(at, draw.choice(lines) * draw.choice([1, 2, 300]))
            case 3:
                lines[at] = " " * draw.randrange(9) + lines[at]
            case 4:
                place = draw.randrange(len(lines[at]) + 1)
                lines[at] = (
                    lines[at][:place] + chr(draw.choice([0, 9, 34, 39, 58, 91, 123, 0x85, 0x1F600])) + lines[at][place:]
                )
    return "".join(lines)


def cases(seed: int, folder: Path) -> Iterator[tuple[Path, Reader, bytes]]:
    """Place, reader and bytes of one config after the other, without end."""
    draw = random.Random(f"configs {seed}")
    found = sources(folder)
    sound = {path: path.read_text(encoding="utf-8") for path, _ in found}
    while True:
        path, read = draw.choice(found)
        if draw.random() < 0.6:
            raw = changed_data(yaml.safe_load(sound[path]), draw)
            text = yaml.safe_dump(raw, allow_unicode=True) if draw.random() < 0.7 else json.dumps(raw, default=str)
        else:
            text = changed_text(sound[path], draw)
        yield path.with_name(f"hostile_{path.name}"), read, text.encode("utf-8", "replace")


def assert_read_in_time(path: Path, read: Reader) -> float:
    """One config read; returns the seconds of processor time that it took. What a terminal must not get of its words
    is spelled out where they are printed."""
    begun, said = time.process_time(), "x"
    try:
        read(path)
    except RigError as error:
        said = str(error)
    assert said, "an error without a word"
    assert "\n" not in said, said
    spent_s, size = time.process_time() - begun, path.stat().st_size
    assert spent_s < allowed_s(read, size), f"{spent_s:.1f} s for {size} bytes"
    return spent_s


def allowed_s(read: Reader, size: int) -> float:
    """Processor time that a config of that size may take."""
    return (ALLOWED_SWEEP_S if read is _sweep else ALLOWED_S) + ALLOWED_S_A_MB * size / 1e6


def one(folder: Path, seed: int) -> Iterator[tuple[float, int, Callable[[], float]]]:
    """For `hostile_work`: the time allowed, the size, and the work, of one config after the other."""
    for path, read, data in cases(seed, folder):
        path.write_bytes(data)
        yield allowed_s(read, len(data)), len(data), partial(assert_read_in_time, path, read)
        path.unlink()


if __name__ == "__main__":
    sys.exit(hostile_work.main("hostile_configs", __doc__ or ""))
