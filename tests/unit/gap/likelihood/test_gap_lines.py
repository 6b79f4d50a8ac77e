"""The transform of columns into lines, judged by SciPy's."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.fft import dct

from rig.gap.likelihood.lines import FAST_FACTORS, fast_length, lines_of


@given(
    seed=st.integers(0, 1000),
    rows=st.lists(st.integers(2, 40), min_size=1, max_size=4),
    top_hz=st.floats(0.1, 80.0),
    columns=st.integers(0, 3),
)
def test_lines_are_the_first_of_scipys_cosine_transform(
    seed: int, rows: list[int], top_hz: float, columns: int
) -> None:
    random, dt_s = np.random.default_rng(seed), 0.01
    lines = lines_of(rows, [dt_s] * len(rows), [np.ones(n) for n in rows], top_hz)
    values = random.standard_normal((sum(rows), columns) if columns else sum(rows))
    parts = np.split(values, np.cumsum(rows)[:-1])
    kept = [
        dct(part, n=fast_length(len(part)), axis=0, norm="ortho")[:count]
        for part, count in zip(parts, lines.counts, strict=True)
    ]
    assert np.allclose(lines.of(values), np.concatenate(kept), atol=1e-12)


@given(st.integers(1, 20_000))
def test_a_fast_length_has_small_factors_and_is_hardly_longer(rows: int) -> None:
    length, left = fast_length(rows), fast_length(rows)
    for factor in FAST_FACTORS:
        while left % factor == 0:
            left //= factor
    assert left == 1
    most = 1.04 if rows > 201 else 1.07  # 113 rows become 120, and 201 become 210
    assert rows <= length <= max(most * rows, rows + 3)
    assert fast_length(length) == length
