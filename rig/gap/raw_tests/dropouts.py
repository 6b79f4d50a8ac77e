"""Drop-outs as a test: how many samples fell to a rail, in bursts of which length, against the baselines."""

from collections.abc import Sequence

import numpy as np

from rig.gap.raw_tests.settings import BASELINE_FALLS, DROPOUT_CHANCE
from rig.gap.raw_tests.signature import Signature, Size, on_days
from rig.gap.raw_tests.statistics import about, wilson
from rig.gap.records.cleaning.dropouts import Dropouts
from rig.gap.records.pairs import Pair

ANGLE = "angle_deg"


def dropouts(pairs: Sequence[Pair], column: str) -> Signature:
    """Falls of one column; those of the angle are the effect sensor_dropout, those of a monitor are said."""
    angle = column == ANGLE
    name, effect = ("drop-outs", "sensor_dropout") if angle else (f"drop-outs of {column.partition('_')[0]}", None)
    mine = [one for pair in pairs for one in pair.dropouts if one.column == column]
    if not mine:
        return Signature(name, effect, False, 0.0, 0.0, "1", "no sample falls to a rail")
    bursts, rows = sum(one.bursts for one in mine), _visible_rows(pairs, mine)
    fallen = sum(int((one.fallen & one.visible).sum()) for one in mine)
    usual_fallen, usual_bursts, usual_rows = _on_earlier_days(pairs, column)
    seen, usual = (bursts, usual_bursts) if usual_bursts else (fallen, BASELINE_FALLS)
    p_value = _by_chance(seen, rows / max(usual_rows, rows) * usual)
    share, base = fallen / rows, usual_fallen / max(usual_rows, 1)
    run = sum(int(one.fallen.sum()) for one in mine) / bursts
    level = float(np.median([one.level for one in mine]))
    unit = "deg" if angle else "MPa"
    rail = f"a rail that reads {level:.4g} {unit}"
    fall = f"{100 * share:.2g} % of the samples fall to {rail}, {run:.2g} in a row in the mean"
    text = f"{fall}{on_days(f'{100 * base:.2g} %', usual_rows > 0)}"
    sizes = {
        "probability": Size(share, *wilson(fallen, rows, run)),
        "rail_deg": Size(level, level, level),
        "burst": about(run, run / np.sqrt(bursts), least=1.0),
    }
    found = p_value < DROPOUT_CHANCE
    power = sum(one.power * len(one.fallen) for one in mine) / sum(len(pair.raw) for pair in pairs)
    if not angle:
        return Signature(name, effect, found, share, base, "1", text, p_value=p_value)
    gone_deg2 = power if found else 0.0
    return Signature(
        name, effect, found, share, base, "1", text, sizes, p_value, variance_deg2=gone_deg2, taken_out_deg2=gone_deg2
    )


def _by_chance(seen: int, expected: float) -> float:
    """Probability that as many are seen where so many are expected (Poisson)."""
    from scipy.special import pdtrc  # 0.2 s to import, and most records have no drop-outs

    return float(pdtrc(seen - 1, expected)) if seen else 1.0


def _visible_rows(pairs: Sequence[Pair], mine: Sequence[Dropouts]) -> int:
    """Rows where a fall would show; a record without any is taken to show as many as the others."""
    share = sum(int(one.visible.sum()) for one in mine) / sum(len(one.visible) for one in mine)
    return max(int(share * sum(len(pair.raw) for pair in pairs)), 1)


def _on_earlier_days(pairs: Sequence[Pair], column: str) -> tuple[int, int, int]:
    """Fallen samples, bursts and rows of all earlier days."""
    found = [one for pair in pairs for day in pair.day_dropouts for one in day if one.column == column]
    rows = sum(len(record) for pair in pairs for record in pair.raw_days)
    return sum(int(one.fallen.sum()) for one in found), sum(one.bursts for one in found), rows
