"""The second round: what the diagnosis recommended is carried out on the same rig, and it is asked again with those
records.

A tie counts as broken when the truth is still named and none of those it was to be told from is.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import numpy as np
import yaml

from rig.blind_check.answer import answer_cases
from rig.blind_check.folder import PRIORS_FILE, CheckFolder, link_day, read_json, read_truth, write_day, write_json
from rig.blind_check.source import Commands, Label, Source
from rig.errors import RigError
from rig.excite.experiment import expand, load_sweep
from rig.excite.setpoints import around

MODE: Final = "pressures"
PERIOD_NS: Final = 5_000_000


def carry_out(source: Source, folder: CheckFolder, labels: Mapping[str, Label]) -> None:
    """Make and answer the second questions of those cases whose first answer left a tie and recommended an
    experiment."""
    again = folder.follow_up()
    asked = []
    for token, label in labels.items():
        if again.answer(token).exists() or not folder.question(token).exists():
            continue
        commands = recommended(read_json(folder.answer(token)))
        if commands:
            _ask(source, folder, token, label, commands)
            asked.append(token)
    if asked:
        answer_cases(str(again.questions), str(again.answers), asked)


def recommended(answer: Mapping[str, Any]) -> Commands:
    """The commands of the experiment an answer recommends for its tie; none without a tie or a sweep that can be
    read."""
    said = answer["modes"].get(MODE, {}).get("diagnosis")
    if not said or len(_set(answer["modes"][MODE])) < 2 or not said.get("next_experiment"):
        return {}
    try:
        return commands_of(said["next_experiment"]["config"])
    except RigError:
        return {}


def commands_of(config: Any) -> Commands:
    """The set-points of a sweep given inline, as text or by its path, on the 5 ms grid."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "next.yaml"
        if isinstance(config, str) and "\n" not in config:
            path = Path(config)
        else:
            path.write_text(config if isinstance(config, str) else yaml.safe_dump(config), encoding="utf-8")
        plans = expand(load_sweep(path), PERIOD_NS)
    return {
        f"next_{plan.name}": (*around(plan.p0_mpa, np.asarray(plan.dp_mpa, float)), PERIOD_NS * 1e-9) for plan in plans
    }


def tie(first: Mapping[str, Any], second: Mapping[str, Any], truth: Sequence[str]) -> dict[str, Any] | None:
    """What the experiment did to a tie that held the truth: the sets before and after, broken or not."""
    before, after = _set(first), _set(second)
    if len(truth) != 1 or truth[0] not in before:
        return None
    rivals = set(first["diagnosis"]["next_experiment"].get("separates", before)) - set(truth)
    return {"before": before, "after": after, "broken": truth[0] in after and not rivals & set(after)}


def _set(answer: Mapping[str, Any]) -> list[str]:
    causes = [cause for cause in answer.get("diagnosis", {}).get("causes", []) if cause["effect"] != "unknown"]
    return [causes[0]["effect"], *causes[0]["ambiguous_with"]] if causes else []


def _ask(source: Source, folder: CheckFolder, token: str, label: Label, commands: Commands) -> None:
    first, place = folder.question(token), folder.follow_up().question(token)
    facts, _, _ = read_truth(folder.truth(token))
    disturbed, days = source.repeat(label, facts, commands)
    link_day(first / "records", place / "records")
    write_day(disturbed, place / "records")
    for number, day in enumerate(days, 1):
        link_day(first / "baselines" / f"day_{number}", place / "baselines" / f"day_{number}")
        write_day(day, place / "baselines" / f"day_{number}")
    for name in ("model.yaml", PRIORS_FILE):
        if (first / name).exists():
            (place / name).write_bytes((first / name).read_bytes())
    write_json(place / "question.json", {"modes": [MODE], "leave_out": []})
