"""A day of a rig as earlier days are compared: two sines, under pressures, with a little noise of its own."""

import numpy as np

from rig.record import Record


def made_day(lag_ticks: int = 0, seed: int = 1, gain: float = 1.0, offset_deg: float = 0.0) -> list[Record]:
    """Two records; the regulators answer `lag_ticks` later than on another day, the sensor reads `gain` times as much
    and `offset_deg` more."""
    rng, t_s = np.random.default_rng(seed), np.arange(2000) * 0.005
    records = []
    for number, hz in enumerate((0.5, 0.8)):
        dp = 0.2 * np.sin(2 * np.pi * hz * t_s)
        answer = np.roll(dp, lag_ticks)
        records.append(
            Record(
                f"sine{number}", t_s, dp, angle_deg=150 * gain * answer + offset_deg + rng.normal(0, 0.05, 2000),
                p1_mpa=0.2 + answer / 2 + rng.normal(0, 5e-4, 2000), p2_mpa=0.2 - answer / 2 + rng.normal(0, 5e-4,
                2000),
            )
        )  # fmt: skip
    return records
