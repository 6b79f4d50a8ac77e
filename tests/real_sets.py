"""The diagnosis on real records that nobody here made: repeats, changes of a dial, and what was named, as a table.

    python tests/real_sets.py ../shared/real [--set friction_damper] [--to FILE] [--anew]

The records come in by a channel map each, as `pamrig log import` would take them; nothing is tuned on them. The
damper's cycles at full stroke are its sessions, each mounting has three. The servo has one run of each gain.

Every answer goes into docs/reference/real_records.json as soon as it is there, and is not asked again when the call is
repeated (`--anew` asks all); `python docs/generated.py` then draws the page's tables.
"""

import argparse
import json
import math
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise, permutations
from pathlib import Path
from typing import Final

import numpy as np
from support.records.mapped_files import read_mapped
from support.records.real_tables import RealSet, Trial, row, told

from rig.app.model.identifying import SearchOptions, StartOptions, identify_model, sweep_range
from rig.channels import Channel, Channels
from rig.errors import RecordError, RigError
from rig.gap.diagnosis import diagnose
from rig.identify.records.data import RecordOptions
from rig.log.foreign.mapping import ColumnSource, Mapping
from rig.log.log_files import stem
from rig.log.reader import record_from_columns
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


def damper(folder: Path, as_joint: bool) -> dict[str, list[list[Record]]]:
    """Mounting -> its sessions, one a cycle at full stroke, each with every sweep whose cycle is long enough."""
    return {one.name: _mounting(one, as_joint) for one in sorted(folder.iterdir()) if one.is_dir()}


def _mounting(folder: Path, as_joint: bool) -> list[list[Record]]:
    cut = [list(_cycles(_damper_record(file, as_joint))) for file in sorted(folder.glob("*.csv.gz"))]
    long = [cycles for cycles in cut if len(cycles) == CYCLES]
    return [[cycles[number] for cycles in long] for number in range(CYCLES)]


def _damper_record(file: Path, as_joint: bool) -> Record:
    channels = Channels(DISPLACEMENT, FORCE)
    columns = {
        "t_s": ColumnSource("t_s", "s"),
        "input": ColumnSource("displacement_in"),
        "output": ColumnSource("friction_force_kip"),
    }
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
    columns = {
        "t_s": ColumnSource("t_s", "s"),
        "input": ColumnSource("goal_rad"),
        "output": ColumnSource("position_rad"),
    }
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
        list(records), start, search, sweep_range(0.2, 0.8, None, records), RecordOptions(resample=False), None
    ).model


def ask(what: str, earlier: str, now: str, model: Model, case: list[Record], days: list[list[Record]]) -> Trial:
    """One diagnosis, told in the rig's own units."""
    try:
        said = diagnose(model, case, days)
    except RecordError as error:
        verdict = "pairs with nothing" if "pairs with a record" in str(error) else "refused"
        return Trial(what, earlier, now, verdict, None, (), None, "", (), None)
    plain = own_plain(said.to_json(), case[0].channels)
    named = [cause for cause in plain["causes"] if cause["effect"] != "unknown"]
    number = next(iter(named[0]["parameters"].values())) if named and named[0]["parameters"] else None
    return Trial(
        what, earlier, now, said.verdict, float(said.gap.ratio),
        tuple(cause["effect"] for cause in plain["causes"]),
        None if number is None else number["value"], "" if number is None else number["unit"],
        tuple(named[0]["ambiguous_with"]) if named else (), said.confidence,
    )  # fmt: skip


@dataclass(frozen=True)
class Question:
    """A trial before it is asked."""

    what: str
    earlier: str
    now: str
    answer: Callable[[], Trial]

    @property
    def key(self) -> tuple[str, str, str]:
        """What tells it from the others of its set."""
        return self.what, self.earlier, self.now


def question(
    what: str, earlier: str, now: str, model: Callable[[str], Model], case: list[Record], days: list[list[Record]]
) -> Question:
    """One diagnosis, and the model of its reference once it is needed."""
    return Question(what, earlier, now, lambda: ask(what, earlier, now, model(earlier), case, days))


def damper_questions(folder: Path, as_joint: bool) -> Iterator[Question]:
    """Every repeat, each cycle against the two others; then every change."""
    mountings = damper(folder, as_joint)
    model = cache(lambda name: simulator(mountings[name][0]))
    for name, sessions in mountings.items():
        for number, case in enumerate(sessions):
            others = [one for place, one in enumerate(sessions) if place != number]
            yield question("repeat", name, f"{name}, cycle {number + 1}", model, case, others)
    for earlier, now in CHANGES:
        yield question("change", earlier, now, model, mountings[now][0], mountings[earlier])


def servo_questions(folder: Path) -> Iterator[Question]:
    """Every gain against every other one."""
    runs = servo(folder)
    model = cache(lambda gain: simulator(runs[gain]))
    for earlier, now in permutations(GAINS, 2):
        yield question("change", earlier, now, model, runs[now], [runs[earlier]])


def tightened_lb(earlier: str, now: str) -> float | None:
    """Within one set of mountings: between sets the damper was taken apart."""
    (first, one), (second, other) = (name.removesuffix("lb").split("_") for name in (earlier, now))
    return float(other) - float(one) if first == second else None


def times_gain(earlier: str, now: str) -> float | None:
    """Logarithm of the ratio of both gains."""
    return math.log(float(now.removeprefix("kp")) / float(earlier.removeprefix("kp")))


DRY: Final = ("coulomb_friction", "backlash")
SETS: Final[dict[str, tuple[Callable[[Path], Iterator[Question]], RealSet]]] = {
    "friction_damper": (
        lambda real: damper_questions(real / "friction_damper", as_joint=False),
        RealSet("damper, force as output", DRY, tightened_lb),
    ),
    "friction_damper_as_joint": (
        lambda real: damper_questions(real / "friction_damper", as_joint=True),
        RealSet("damper as a joint", DRY, tightened_lb),
    ),
    "xl330_gain": (
        lambda real: servo_questions(real / "xl330_gain"),
        RealSet("servo", ("stiffness",), times_gain),
    ),
}
KEPT: Final = Path(__file__).resolve().parent.parent / "docs" / "reference" / "real_records.json"


def main() -> None:
    """Ask what is not answered yet, and keep each answer."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("real", type=Path)
    parser.add_argument("--set", choices=list(SETS), action="append")
    parser.add_argument("--to", type=Path, default=KEPT)
    parser.add_argument("--anew", action="store_true")
    asked = parser.parse_args()
    known = json.loads(asked.to.read_text(encoding="utf-8")) if asked.to.exists() else {}
    for name in asked.set or SETS:
        questions, real = SETS[name]
        trials = [] if asked.anew else [Trial(**one) for one in known.get(name, {}).get("trials", [])]
        answered = {(one.what, one.earlier, one.now) for one in trials}
        for one in questions(asked.real):
            if one.key not in answered:
                trials.append(one.answer())
                known[name] = told(real, trials)
                asked.to.write_text(json.dumps(known, indent=1) + "\n", encoding="utf-8")
                print(name, " | ".join(row(trials[-1])), flush=True)


if __name__ == "__main__":
    try:
        main()
    except RigError as error:
        sys.exit(str(error))
