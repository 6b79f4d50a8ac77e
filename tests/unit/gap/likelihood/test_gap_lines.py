"""The transform of columns into lines, judged by SciPy's."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.fft import dct

from rig.gap.likelihood.lines import lines_of


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
    kept = [dct(part, axis=0, norm="ortho")[:count] for part, count in zip(parts, lines.counts, strict=True)]
    assert np.allclose(lines.of(values), np.concatenate(kept), atol=1e-12)
