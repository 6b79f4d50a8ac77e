"""How a law may be wrong: what is expected of what it leaves of a change that is really its own."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rig.gap.likelihood.gaussian import Gaussian
from rig.gap.likelihood.lines import Lines
from rig.gap.likelihood.rough_law import RoughLaw
from rig.gap.priors import Prior
from rig.gap.settings import ENVELOPE_EVEN, ENVELOPE_HZ
from rig.record import Column


def with_law(healthy: Gaussian, lines: Lines, moved: Column, rho: float, prior: Prior) -> Gaussian:
    """What is expected of what a law leaves when it is as rough as a share `rho` of what it changes, `moved` (l,)."""
    if rho <= 0.0:
        return healthy
    rough = rough_lines(lines, moved, rho, prior)
    return healthy.with_patterns(law_patterns(moved, lines, rho)).with_variance(rough)


def log_densities(
    healthy: Gaussian, lines: Lines, moved: Column, residual: Column, rhos: Sequence[float], prior: Prior
) -> list[float]:
    """Log density of what a law leaves (l,) for each of several shares `rho` by which it may be wrong: that of
    `with_law`, whose patterns are not written out."""
    power = lines.envelope(moved, ENVELOPE_HZ, ENVELOPE_EVEN)
    law = rough_law(healthy, lines, moved, 1.0)
    return [
        healthy.with_variance(rough_lines(lines, moved, rho, prior, power)).log_density(residual, replace(law, rho=rho))
        if rho > 0.0
        else healthy.log_density(residual)
        for rho in rhos
    ]


def rough_law(healthy: Gaussian, lines: Lines, moved: Column, rho: float) -> RoughLaw:
    """`law_patterns` of what a law changes (`moved`, (l,)) beside those of what is expected, not written out."""
    columns = np.column_stack([healthy.patterns, moved, later_pattern(moved, lines, 1.0)])
    return RoughLaw(columns, lines.ends, rho)


def rough_lines(lines: Lines, moved: Column, rho: float, prior: Prior, power: Column | None = None) -> Column:
    """(l,) variance of the lines of what so rough a law leaves."""
    power = lines.envelope(moved, ENVELOPE_HZ, ENVELOPE_EVEN) if power is None else power
    out: Column = (prior.rho_lines * rho) ** 2 * power
    return out


def law_patterns(moved: Column, lines: Lines, rho: float) -> Column:
    """(l, k) how a law may be wrong: its change in each record a little larger or smaller, and a little earlier or
    later."""
    count = int(lines.record.max()) + 1
    out = np.zeros((len(moved), count + 1))
    out[np.arange(len(moved)), lines.record] = rho * moved
    out[:, count] = later_pattern(moved, lines, rho)
    return out


def later_pattern(moved: Column, lines: Lines, rho: float) -> Column:
    """(l,) the last of them: a little earlier or later in all records."""
    frequency = lines.frequency_hz
    turned = moved * frequency
    # in proportion to what moves: with a constant's power in the scale, the monitors' noise on top of it would be free
    norm = np.sqrt(np.sum(moved[frequency > 0.0] ** 2) / max(np.sum(turned**2), 1e-30))
    out: Column = rho * norm * turned
    return out
