"""All tests on the raw samples of a case, the ones that find nothing too: what was looked for is part of the evidence.

Each compares the case with its own baselines by medians and shares, so that a nominal converter's step or a nominal
level of noise is no finding. Without a baseline what is found must be plain; noise and step are compared with the noise
that a model's fingerprint knows, where there is one, and noise with what rigs usually have, where there is none.
"""

from collections.abc import Sequence

from rig.gap.raw_tests.dropouts import ANGLE, dropouts
from rig.gap.raw_tests.lost_samples import lost_samples, without_lost
from rig.gap.raw_tests.monitors import mean_pressure, wires
from rig.gap.raw_tests.noise import KnownNoise, NoNoise, noise
from rig.gap.raw_tests.noise_levels import angles_of, level_deg, once
from rig.gap.raw_tests.quantisation import fine_step_deg, quantisation_step
from rig.gap.raw_tests.repeats import repeated_samples
from rig.gap.raw_tests.signature import Signature
from rig.gap.raw_tests.spectral_lines import fast_spectra, mains_line, spurious_tone
from rig.gap.raw_tests.time_stamps import time_stamps
from rig.gap.records.pairs import Pair


def read_signatures(pairs: Sequence[Pair], known: KnownNoise | None = None) -> list[Signature]:
    """The results of all tests; what is `known` of the angle's noise counts where no earlier day is there."""
    cases = [pair.raw for pair in pairs]
    count = min((len(pair.raw_days) for pair in pairs), default=0)
    sessions = [[pair.raw_days[k] for pair in pairs] for k in range(count)]
    level_of = once(level_deg)
    own_deg = known.level_deg if known is not None and known.of_this_rig else None
    step = quantisation_step(cases, sessions, own_deg)
    coarsest = max(step.value, step.baseline)
    step_deg = coarsest or fine_step_deg(angles_of(cases))
    repeats = repeated_samples(cases, sessions, step_deg, not step.found, level_of)
    held = repeats.found
    if held and sessions:  # what stands still and jumps is neither a line nor noise: beside days that do so as well
        lost, held = [lost_samples(case) for case in cases], False
        cases = [without_lost(case, rows) for case, rows in zip(cases, lost, strict=True)]
        sessions = [[without_lost(day, rows) for day, rows in zip(session, lost, strict=True)] for session in sessions]
    fast, usual = fast_spectra(cases), [fast_spectra(session) for session in sessions]
    lines = [mains_line(fast, usual), spurious_tone(fast, usual)]
    no_noise = NoNoise(step, held, [line for line in lines if line.found], fast)
    louder = noise(cases, sessions, no_noise, known, level_of)
    falls = [dropouts(pairs, column) for column in (ANGLE, "p1_mpa", "p2_mpa")]
    return [
        step,
        repeats,
        *falls,
        *lines,
        louder,
        time_stamps(pairs, sessions),
        mean_pressure(cases, sessions),
        *wires(cases),
    ]
