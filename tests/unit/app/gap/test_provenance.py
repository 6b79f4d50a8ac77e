"""Where each fitted number comes from: of every number of the shipped file it is said, and each command says it of its
own part alone."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import yaml

from rig.app.gap.calibrating import FittingPlan, provenance_of, with_what_others_fit, write
from rig.gap.priors import PRIORS, fitted
from rig.gap.provenance import EVERYTHING, FitProvenance, Origin

SHIPPED: dict[str, Any] = yaml.safe_load(PRIORS.read_text(encoding="utf-8"))
ANEW, OLD = Origin("anew"), Origin("before")


def leaves(found: object, path: str = "") -> Iterator[str]:
    """The path of every number, `law_shares` as one."""
    if isinstance(found, Mapping):
        for key, value in found.items():
            yield from leaves(value, f"{path}.{key}".lstrip("."))
    else:
        yield path


NUMBERS = [path for path in leaves(SHIPPED) if not path.startswith("provenance.")]


def test_of_every_number_it_is_said_where_it_comes_from() -> None:
    assert [path for path in NUMBERS if fitted().provenance.of(path) is None] == []


def test_every_part_stands_in_the_file() -> None:
    parts = fitted().provenance.parts
    assert [part for part in parts if not any(f"{path}.".startswith(f"{part}.") for path in NUMBERS)] == []


def test_the_shipped_file_is_as_the_commands_write_it(tmp_path: Path) -> None:
    write(fitted(), tmp_path / "priors.yaml")
    assert (tmp_path / "priors.yaml").read_text(encoding="utf-8") == PRIORS.read_text(encoding="utf-8")


def test_a_file_whose_provenance_is_one_sentence_is_read_as_ever(tmp_path: Path) -> None:
    old = tmp_path / "old.yaml"
    provenance = {"command": "levels by a command", "families": ["mckibben"], "units": 10, "healthy_records": 30}
    old.write_text(yaml.safe_dump({**SHIPPED, "provenance": provenance}), encoding="utf-8")
    found = fitted(old)
    assert found.levels == fitted().levels
    assert (found.provenance.families, found.provenance.units) == (["mckibben"], 10)
    assert found.provenance.of("levels.session.odds") == Origin("levels by a command")


def test_a_file_that_calls_the_prediction_interval_further_is_read_as_ever(tmp_path: Path) -> None:
    old = tmp_path / "old.yaml"
    raw = {"further" if key == "prediction" else key: value for key, value in SHIPPED.items()}
    old.write_text(yaml.safe_dump(raw), encoding="utf-8")
    assert fitted(old).prediction == fitted().prediction


@pytest.mark.parametrize(
    ("path", "origin"),
    [("prediction.floor", OLD), ("levels.session.odds.none", ANEW), ("levels.session.floor", OLD), ("levels", OLD)],
)
def test_the_longest_path_counts(path: str, origin: Origin) -> None:
    assert FitProvenance([], 0, 0, {EVERYTHING: OLD, "levels.session.odds": ANEW}).of(path) == origin


def test_what_is_renewed_takes_what_stood_under_it_along_and_nothing_beside_it() -> None:
    before = FitProvenance(
        [], 0, 0, {"prediction": OLD, "levels.a.odds": OLD, "levels.a.odds.together": OLD, "levels.ab": OLD}
    )
    after = before.renewed({"levels.a.odds": ANEW})
    assert after.parts == {"prediction": OLD, "levels.a.odds": ANEW, "levels.ab": OLD}


def test_what_is_renewed_leaves_what_is_untouched_below_it() -> None:
    before = FitProvenance([], 0, 0, {"levels": OLD, "levels.a.odds.together": ANEW})
    after = before.renewed({"levels": ANEW}, ["levels.a.odds", "levels.b.usual"])
    assert after.parts == {
        "levels": ANEW, "levels.a.odds": OLD, "levels.a.odds.together": ANEW, "levels.b.usual": OLD,
    }  # fmt: skip


def test_levels_fitted_anew_leave_what_other_commands_fit() -> None:
    shipped = fitted()
    made = provenance_of(FittingPlan(("bellows",), 3, 7), shipped)
    assert (made.families, made.units, made.healthy_records) == (["bellows"], 3, 9)
    changed = {path for path in NUMBERS if made.of(path) != shipped.provenance.of(path)}
    others = (".odds.", ".usual.")
    assert changed == {
        path for path in NUMBERS if path.startswith("levels.") and not any(part in path for part in others)
    }
    assert all(made.of(path) == made.parts["levels"] for path in changed)
    assert made.parts["levels"].seeds == [7]


def test_levels_fitted_anew_keep_the_odds_and_what_simulators_usually_lack() -> None:
    shipped = fitted().levels["simulator"]
    kept = with_what_others_fit(replace(shipped, odds=fitted().levels["session"].odds, usual=None), shipped)
    assert kept == shipped
    assert shipped.usual is not None
