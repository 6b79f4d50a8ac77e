"""No answer contradicts itself, whatever is wrong with the rig and whatever it is compared with: the physics of a build
that nothing was fitted on, drawn effects and sizes, every way of asking."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from hil.reference.cases import Bench, Purpose, bench_of, draw_sheet, record_day
from hil.reference.disturbance import Disturbance, merged
from rig.blind_check.generate import nominal_model, without_fingerprint
from rig.blind_check.modes import BARE, MODES, SISTER, Mode
from rig.blind_check.source import records_of
from rig.gap.answer.consistency import contradictions
from rig.gap.diagnosis import diagnose
from rig.model.parameters import Model
from rig.record import Record

FAMILY, SEED, RECORDS = "pleated", 77, 3
ASKED = [mode for mode in MODES.values() if not mode.withheld]


@dataclass(frozen=True)
class Rig:
    """One unit, some of its healthy days, its simulator and a sister's."""

    bench: Bench
    days: tuple[tuple[Record, ...], ...]
    own: Model
    sister: Model

    def simulator(self, mode: Mode) -> Model:
        """The one that the mode is asked with."""
        return {SISTER: self.sister, BARE: without_fingerprint(self.own)}.get(mode.model, self.own)


@cache
def rig() -> Rig:
    bench = bench_of(draw_sheet(Purpose.DEVELOPMENT, SEED, 10, FAMILY)[0])
    p0_mpa = bench.excitations[0].p0_mpa
    days = tuple(tuple(records_of(day)[:RECORDS]) for day in bench.baselines[:3])
    simulators = (nominal_model(records_of(day), p0_mpa) for day in (bench.baselines[0], bench.sister))
    return Rig(bench, days, *simulators)


@st.composite
def wrongs(draw: st.DrawFn) -> list[tuple[str, float]]:
    """None, one or two effects, known ones and foreign ones, with their signed sizes: at this share of their range."""
    laws = rig().bench.family.laws
    names = draw(st.lists(st.sampled_from(sorted(laws)), max_size=2, unique=True))
    sized = []
    for name in names:
        law, share = laws[name], draw(st.floats(0.05, 0.8))
        size = float(np.exp(np.interp(share, (0.0, 1.0), np.log((law.low, law.high)))))
        sized.append((name, size * (draw(st.sampled_from((-1, 1))) if law.signed else 1)))
    return sized


def records(sized: Sequence[tuple[str, float]], day: int) -> list[Record]:
    bench = rig().bench
    parts: list[Disturbance] = [bench.family.laws[name].law(size, np.random.default_rng(day)) for name, size in sized]
    wrong = merged(bench.family.healthy, parts)
    return records_of(record_day(bench.plant, bench.plant.session(day, 0.008), bench.excitations[:RECORDS], wrong))


@settings(max_examples=10)
@given(wrongs(), st.sampled_from(ASKED), st.integers(0, 99))
def test_no_answer_contradicts_itself(sized: list[tuple[str, float]], mode: Mode, day: int) -> None:
    days = rig().days[: mode.days]
    answer = diagnose(
        rig().simulator(mode), records(sized, day), days, pressures=mode.pressures, reference=mode.reference
    ).to_json()
    assert contradictions(answer) == []
