"""The diagnosis on real records that nobody here made: repeats, changes of a dial, and what was named, as a table.

    python tests/real_sets.py ../shared/real [--set friction_damper or xl330_gain] [--json FILE]

The records come in by a channel map each, as `pamrig log import` would take them; nothing is tuned on them. The
damper's cycles at full stroke are its sessions, each mounting has three. The servo has one run of each gain.
"""

import argparse
import json
import math
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Final

import numpy as np

from rig.app.model.identifying import SearchOptions, StartOptions, identify_model, sweep_range
from rig.channels import Channel, Channels
from rig.errors import RecordError, RigError
from rig.gap.diagnosis import diagnose
from rig.identify.data import Options
from rig.log.foreign.mapping import Mapping, Source, read_mapped
from rig.log.reader import record_from_columns, stem
from rig.model.parameters import Model
from rig.own_units import own_plain
from rig.record import Column, Record

DISPLACEMENT: Final = Channel("displacement", "in", (-1.5, 1.5))
FORCE: Final = Channel("friction_force", "kip", (-5.0, 5.0))
SEAT: Final = Channel("seat", "in", (-1.5, 1.5))
SEAT_KIP_PER_IN: Final = 20.0
"""Stiffness of the seat that the force is taken to act on, where the damper is seen as a joint: displacement minus
force over stiffness."""
SERVO: Final = Channels(Channel("goal", "rad", (-1.3, 1.3)), Channel("position", "rad", (-1.3, 1.3)))
CYCLES: Final = 3
FULL: Final = 0.97
"""Share of the largest stroke from which on a stroke is a full one."""
LEAST_CYCLE_S: Final = 2.0
"""A shorter record is not judged."""
MOUNTINGS: Final = ("20", "22", "25", "35", "70", "80")
CHANGES: Final = (
    *((f"set1_{a}lb", f"set1_{b}lb") for a, b in pairwise(MOUNTINGS)),
    *((f"set1_{b}lb", f"set1_{a}lb") for a, b in pairwise(MOUNTINGS)),
    *(("set1_20lb", f"set1_{b}lb") for b in MOUNTINGS[2:]),
    *(("set2_00lb", "set2_30lb"), ("set2_30lb", "set2_36lb"), ("set2_36lb", "set2_30lb"), ("set2_30lb", "set2_00lb")),
    *(("set2_30lb", "set3_30lb"), ("set3_30lb", "set2_30lb")),
)  # fmt: skip
"""(earlier, now) of the damper."""
GAINS: Final = ("kp100", "kp200", "kp400", "kp800")


@dataclass(frozen=True)
class Trial:
    """One question and its answer."""

    what: str
    earlier: str
    now: str
    verdict: str
    ratio: float
    causes: tuple[str, ...]
    size: float | None
    unit: str
    ambiguous: tuple[str, ...]
    confidence: float


def damper(folder: Path, as_joint: bool) -> dict[str, list[list[Record]]]:
    """Mounting -> its sessions, one a cycle at full stroke, each with every sweep whose cycle is long enough."""
    return {one.name: _mounting(one, as_joint) for one in sorted(folder.iterdir()) if one.is_dir()}


def _mounting(folder: Path, as_joint: bool) -> list[list[Record]]:
    cut = [list(_cycles(_damper_record(file, as_joint))) for file in sorted(folder.glob("*.csv.gz"))]
    long = [cycles for cycles in cut if len(cycles) == CYCLES]
    return [[cycles[number] for cycles in long] for number in range(CYCLES)]


def _damper_record(file: Path, as_joint: bool) -> Record:
    channels = Channels(DISPLACEMENT, FORCE)
    columns = {"t_s": Source("t_s", "s"), "input": Source("displacement_in"), "output": Source("friction_force_kip")}
    table, facts = read_mapped(file, Mapping(columns, channels, facts={"session": file.parent.name}))
    if as_joint:
        seen = Channels(DISPLACEMENT, SEAT)
        force_kip = channels.own_output(table["angle_deg"])
        seat_in = channels.own_input(table["dp_cmd_mpa"]) - force_kip / SEAT_KIP_PER_IN
        table, facts = table | {"angle_deg": seen.working_output(seat_in)}, facts | {"channels": seen.plain()}
    return record_from_columns(table, facts, file)


def _cycles(record: Record) -> Iterator[Record]:
    """The cycles at full stroke, one after the other; none where they are too short to be judged."""
    hertz = float(stem(Path(record.name)).split("_")[1].removesuffix("hz"))
    rows = round(1.0 / (hertz * record.period_s))
    if rows * record.period_s < LEAST_CYCLE_S - record.period_s:
        return
    first = _first_full_stroke(record.dp_cmd_mpa)
    for number in range(CYCLES):
        start = first + number * rows
        part = record.rows(slice(start, start + rows + 3))  # a hair more than the least that is judged
        if len(part) == rows + 3:
            yield replace(part, t_s=part.t_s - part.t_s[0])


def _first_full_stroke(course: Column) -> int:
    """The row of the zero crossing before the first peak at full stroke: before it lies the ramp."""
    centred = course - 0.5 * (course.max() + course.min())
    peak = int(np.argmax(np.abs(centred) >= FULL * np.abs(centred).max()))
    crossings = np.nonzero(np.diff(np.sign(centred[:peak])))[0]
    return int(crossings[-1]) + 1


def servo(folder: Path) -> dict[str, list[Record]]:
    """Gain -> its three trajectories."""
    columns = {"t_s": Source("t_s", "s"), "input": Source("goal_rad"), "output": Source("position_rad")}
    found = {}
    for gain in GAINS:
        read = [(file, read_mapped(file, Mapping(columns, SERVO))) for file in sorted((folder / gain).glob("*.csv.gz"))]
        found[gain] = [record_from_columns(table, facts, file) for file, (table, facts) in read]
    return found


def simulator(records: Sequence[Record]) -> Model:
    """A model of the reference's records, by a short search: sessions need it for `how far` alone."""
    start = StartOptions(None, "mbw", "auto", "rigid", None, None, 0.2, False, None)
    search = SearchOptions("pso", 1, 1, 40, 120, None, True, True)
    return identify_model(
        list(records), start, search, sweep_range(0.2, 0.8, None, records), Options(resample=False), None
    ).model


def ask(what: str, earlier: str, now: str, model: Model, case: list[Record], days: list[list[Record]]) -> Trial:
    """One diagnosis, told in the rig's own units."""
    try:
        said = diagnose(model, case, days)
    except RecordError:  # another stroke is another sweep
        return Trial(what, earlier, now, "pairs with nothing", math.nan, (), None, "", (), math.nan)
    plain = own_plain(said.to_json(), case[0].channels)
    named = [cause for cause in plain["causes"] if cause["effect"] != "unknown"]
    number = next(iter(named[0]["parameters"].values())) if named and named[0]["parameters"] else None
    return Trial(
        what, earlier, now, said.verdict, float(said.gap.ratio),
        tuple(cause["effect"] for cause in plain["causes"]),
        None if number is None else number["value"], "" if number is None else number["unit"],
        tuple(named[0]["ambiguous_with"]) if named else (), said.confidence,
    )  # fmt: skip


def damper_trials(folder: Path, as_joint: bool) -> Iterator[Trial]:
    """Every repeat, each cycle against the two others; then every change."""
    mountings = damper(folder, as_joint)
    models = {name: simulator(sessions[0]) for name, sessions in mountings.items()}
    for name, sessions in mountings.items():
        for number, case in enumerate(sessions):
            others = [one for place, one in enumerate(sessions) if place != number]
            yield ask("repeat", name, f"{name}, cycle {number + 1}", models[name], case, others)
    for earlier, now in CHANGES:
        yield ask("change", earlier, now, models[earlier], mountings[now][0], mountings[earlier])


def servo_trials(folder: Path) -> Iterator[Trial]:
    """Every gain against every other one."""
    runs = servo(folder)
    models = {gain: simulator(records) for gain, records in runs.items()}
    for earlier in GAINS:
        for now in GAINS:
            if now != earlier:
                yield ask("change", earlier, now, models[earlier], runs[now], [runs[earlier]])


HEAD: Final = "| what | earlier | now | verdict | in floors | named | size | alike | sure |"
SETS: Final = {
    "friction_damper": lambda real: damper_trials(real / "friction_damper", as_joint=False),
    "friction_damper_as_joint": lambda real: damper_trials(real / "friction_damper", as_joint=True),
    "xl330_gain": lambda real: servo_trials(real / "xl330_gain"),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("real", type=Path)
    parser.add_argument("--set", choices=list(SETS), action="append")
    parser.add_argument("--json", type=Path)
    asked = parser.parse_args()
    told = {}
    for name in asked.set or SETS:
        print(
            f"\n{name}\n\n| what | earlier | now | verdict | in floors | named | size | alike | sure |\n|{'---|' * 9}"
        )
        told[name] = []
        for trial in SETS[name](asked.real):
            told[name].append(asdict(trial))
            print(line(trial), flush=True)
    if asked.json:
        asked.json.write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")


def line(trial: Trial) -> str:
    """A row of the table."""
    size = "" if trial.size is None else f"{trial.size:.3g} {trial.unit}"
    cells = (
        trial.what, trial.earlier, trial.now, trial.verdict, f"{trial.ratio:.1f}", ", ".join(trial.causes), size,
        ", ".join(trial.ambiguous), f"{trial.confidence:.2f}",
    )  # fmt: skip
    return f"| {' | '.join(cells)} |"


if __name__ == "__main__":
    try:
        main()
    except RigError as error:
        sys.exit(str(error))
