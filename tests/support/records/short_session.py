"""A session for blind checks in small: every day of theirs is recorded under it."""

import numpy as np

from hil.reference.source import Commands


def short_session() -> Commands:
    """Four records of 8 s, which tell enough of effects of these sizes; a drawn session is seven of 20 s."""
    t_s = np.arange(0.0, 8.0, 0.005)
    slow, fast = 2 * np.pi * 0.4 * t_s, 2 * np.pi * 0.8 * t_s
    dp_mpa = {
        "sine_0.4": 0.18 * np.sin(slow),
        "sine_0.8": 0.1 * np.sin(fast),
        "triangle_0.8": 0.14 * 2 / np.pi * np.arcsin(np.sin(fast)),
        "mixed": 0.1 * np.sin(0.6 * slow) + 0.07 * np.sin(fast),
    }
    return {name: (0.2 + 0.5 * dp, 0.2 - 0.5 * dp, 0.005) for name, dp in dp_mpa.items()}
