"""Further rounds: what an answer recommended is carried out on the same rig with the same cause in it, and it is asked
again with those records beside the first.

An experiment is recorded once, on the day of the case: no earlier day holds records of its kind, so the answer has to
do without, as a hunt on a rig has. Each mode asks for experiments of its own.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import numpy as np
import yaml

from rig.blind_check.answer import answer_cases
from rig.blind_check.folder import (
    PRIORS_FILE,
    CheckFolder,
    link_day,
    read_json,
    read_truth,
    without_times,
    write_day,
    write_json,
)
from rig.blind_check.modes import MODES, MOST_FOLLOW_UPS
from rig.blind_check.row import Facts, Round, Row, Truth
from rig.blind_check.score import score_mode
from rig.blind_check.source import Commands, Label, Source
from rig.errors import RigError
from rig.excite.run_plan import expand
from rig.excite.setpoints import around
from rig.excite.sweep import load_sweep

PERIOD_NS: Final = 5_000_000
"""Of the set-points of an experiment that an answer asks for, ns: 5 ms, the loop's usual period."""


def carry_out(source: Source, folder: CheckFolder, labels: Mapping[str, Label], rounds: int = MOST_FOLLOW_UPS) -> None:
    """Make and answer the further questions of those cases whose last answer recommended an experiment; none where
    nothing can be recorded anew."""
    for number in range(1, rounds + 1 if source.can_repeat else 1):
        again = folder.follow_up(number)
        asked = [token for token, label in labels.items() if _ask(source, folder, token, label, number)]
        if asked:
            answer_cases(str(again.questions), str(again.answers), asked)


def recommended(answer: Mapping[str, Any]) -> dict[str, Commands]:
    """Mode by mode the commands of the experiment that an answer recommends; none where it recommends none, or a sweep
    that cannot be read. Only the modes of the goals are asked again."""
    found = {}
    for mode, reply in answer["modes"].items():
        wanted = (reply.get("diagnosis") or {}).get("next_experiment")
        if wanted and not MODES[mode].withheld:
            try:
                found[mode] = commands_of(wanted["config"])
            except RigError:
                continue
    return found


def commands_of(config: Any) -> Commands:
    """The set-points of a sweep given inline, as text or by its path, on the 5 ms grid; ConfigError when it is none."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "next.yaml"
        if isinstance(config, Path) or (isinstance(config, str) and "\n" not in config):
            path = Path(config)
        else:
            path.write_text(config if isinstance(config, str) else yaml.safe_dump(config), encoding="utf-8")
        plans = expand(load_sweep(path), PERIOD_NS)
    return {plan.name: (*around(plan.p0_mpa, np.asarray(plan.dp_mpa, float)), PERIOD_NS * 1e-9) for plan in plans}


def rounds_of(folder: CheckFolder, token: str, truth: Truth, facts: Facts) -> dict[str, list[Round]]:
    """Mode by mode the scored answers after each further experiment, with what that had promised."""
    found: dict[str, list[Round]] = {}
    for number in range(1, MOST_FOLLOW_UPS + 1):
        answered = _round(folder, number).answer(token)
        if not answered.exists():
            break
        before = read_json(_round(folder, number - 1).answer(token))["modes"]
        for mode, reply in read_json(answered)["modes"].items():
            row = score_mode(mode, reply, truth, facts)
            wanted = before[mode]["diagnosis"]["next_experiment"]
            found.setdefault(mode, []).append(_round_after(wanted, reply, row))
    return found


def _round_after(wanted: Mapping[str, Any], reply: Mapping[str, Any], row: Row) -> Round:
    names = set(wanted["separates"])
    causes = (reply.get("diagnosis") or {"causes": []})["causes"]
    truth = names & set(row.effects)
    left = names & {name for cause in causes for name in (cause["effect"], *cause["ambiguous_with"])}
    return Round(
        row,
        minutes=wanted["minutes"],
        promised=wanted["expected_confidence"],
        separates=tuple(sorted(names)),
        parted=left == truth if truth else None,
    )


def _round(folder: CheckFolder, number: int) -> CheckFolder:
    return folder.follow_up(number) if number else folder


def _ask(source: Source, folder: CheckFolder, token: str, label: Label, number: int) -> bool:
    """Write the question of one round; whether there is one to be answered."""
    first, again = folder.question(token), _round(folder, number)
    before = _round(folder, number - 1).answer(token)
    if again.answer(token).exists() or not first.exists() or not before.exists():
        return False
    wanted = recommended(read_json(before))
    if not wanted:
        return False
    place = again.question(token)
    facts, _, _ = read_truth(folder.truth(token))
    for day in ("records", *(f"baselines/day_{k}" for k in range(1, int(label["baselines"]) + 1))):
        link_day(first / day, place / day)
    for file in (*first.glob("*.yaml"), first / PRIORS_FILE):
        if file.exists():
            (place / file.name).write_bytes(file.read_bytes())
    for mode, commands in wanted.items():
        for earlier in range(1, number):
            link_day(_experiment(folder, earlier, token, mode), _experiment(folder, number, token, mode, earlier))
        write_day(source.repeat(label, facts, commands, number), _experiment(folder, number, token, mode))
    write_json(place / "question.json", {"modes": _in_order(wanted), "leave_out": []})
    without_times(place)
    return True


def _experiment(folder: CheckFolder, number: int, token: str, mode: str, which: int | None = None) -> Path:
    """Where a round's question holds the records of an experiment: its own, or that of an earlier round."""
    return _round(folder, number).question(token) / "experiments" / mode / str(which or number)


def _in_order(modes: Mapping[str, Any]) -> Sequence[str]:
    return [mode for mode in MODES if mode in modes]
