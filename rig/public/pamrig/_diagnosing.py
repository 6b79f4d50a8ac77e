"""Why a rig and its simulator differ, or what has changed on a rig since earlier days."""

import logging
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from pamrig._models import Identified, _model, save_model
from pamrig._picture import Picture, Table, Tabled
from pamrig._places import Logs, place_of, records_of
from rig.app.gap.baselines import EarlierDay, agreeing, check_no_own_baseline, read_days
from rig.app.gap.effects import check_effects
from rig.errors import ConfigError, ModelError
from rig.gap.answer.result import Cause
from rig.gap.answer.result import Diagnosis as Answer
from rig.gap.answer.words.sentences import answers
from rig.gap.diagnosis import diagnose_with_grounds
from rig.model.parameters import Model
from rig.own_units import own_text
from rig.record import Record

if TYPE_CHECKING:
    from rig.gap.pipeline import Grounds

_LOG = logging.getLogger("pamrig")
Reference = Literal["auto", "sessions", "session", "fingerprint", "simulator"]


class Diagnosis(Tabled):
    """Where the gap lies, which effects cause it, how far it shrinks with them.

    >>> diagnosis = pamrig.diagnose("simulated", "worn")
    >>> diagnosis.verdict, diagnosis.causes[0].stage
    ('explained', 'valve')
    """

    def __init__(self, answer: Answer, grounds: "Grounds", model: Model | None) -> None:
        self._answer, self._grounds, self._model = answer, grounds, model

    @property
    def verdict(self) -> str:
        """none, explained, partly_explained or unknown."""
        return self._answer.verdict.value

    @property
    def causes(self) -> list[Cause]:
        """What was named: effect, stage, parameters with their intervals, confidence, what it may be mistaken for."""
        return list(self._answer.causes)

    @property
    def gap(self) -> Mapping[str, Any]:
        """How large the gap is, and the floor below which none is seen."""
        return self._answer.gap.to_json()

    @property
    def answers(self) -> dict[str, str]:
        """The answer in sentences, by question."""
        return {question: own_text(answer, self._answer.channels) for question, answer in answers(self._answer).items()}

    def to_json(self) -> dict[str, Any]:
        """What `pamrig gap diagnose --json` writes for one day."""
        return self._answer.to_json()

    def save_page(self, place: str | Path) -> None:
        """The report as one HTML page; ModelError without a simulator."""
        from rig.report.gap_page import write_page

        write_page(place_of(place, "save_page"), self._answer, self._grounds, self._simulator("a page"))

    def save_augmented(self, place: str | Path) -> None:
        """The simulator with the named causes added, as YAML; ModelError without a simulator."""
        from rig.gap.answer.how_far.augment import augmented

        save_model(augmented(self._simulator("an augmented model"), self._answer, self._grounds.expected), place)

    def plot(self) -> Picture:
        """The record with the largest gap: residual and angle over time, before and with the causes."""
        from rig.report.gap_figures import over_time_figure

        return Picture(over_time_figure(self._answer, self._grounds))

    def _simulator(self, wanted: str) -> Model:
        if self._model is None:
            raise ModelError(f"{wanted} needs a simulator: give diagnose a model")
        return self._model

    def _table(self) -> Table:
        return Table(("", ""), [*self.answers.items()])


def diagnose(
    model: Model | Identified | str | Path | None,
    logs: Logs,
    baselines: Iterable[Logs] = (),
    *,
    pressures: bool = True,
    effects: Sequence[str] | None = None,
    reference: Reference = "auto",
    every_day: bool = False,
) -> Diagnosis:
    """Explain records: by what the simulator lacks, or, with `baselines` (one entry an earlier day), by what has
    changed.

    A folder that has its logs in folders only is one day in each, as for `pamrig gap diagnose`; Error when an earlier
    day contains the place of `logs`, or is in it. An earlier day that disagrees with the others is left out, and said
    to the log `pamrig`; `every_day=True` keeps it.

    `pressures=False` leaves the measured pressures out, `effects` limits the library by name. RecordError when no
    record can be used, ModelError when there is nothing to compare with.
    """
    check_effects(list(effects or ()))
    simulator = None if model is None else _model(model)
    if isinstance(baselines, Record | str | Path) or not isinstance(baselines, Iterable):
        raise ConfigError(f"baselines: expected a list with one entry an earlier day, got {baselines!r:.60}")
    days = _days(logs, list(baselines), every=every_day)
    library = list(effects) if effects else None
    answer, grounds = diagnose_with_grounds(
        simulator,
        records_of(logs),
        days,
        pressures=pressures,
        library=library,
        reference=reference,
    )
    return Diagnosis(answer, grounds, simulator)


def _days(logs: Logs, baselines: Sequence[Logs], *, every: bool) -> list[list[Record]]:
    """The records of each earlier day; one that disagrees with the others is left out, and said to the log."""
    places = [Path(day) for day in baselines if isinstance(day, str | Path)]
    check_no_own_baseline([Path(logs)] if isinstance(logs, str | Path) else [], places)
    sessions: list[EarlierDay] = []
    for number, day in enumerate(baselines, 1):
        if isinstance(day, str | Path):
            sessions += read_days([Path(day)])
        else:
            sessions.append(EarlierDay(Path(f"day {number}"), records_of(day)))
    earlier = agreeing(sessions, every=every)
    for odd in earlier.odd.values():
        _LOG.warning("%s", odd)
    return earlier.records
