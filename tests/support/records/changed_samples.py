"""Changes of an angle's raw samples, as a sensor or a link makes them: for tests of what raw samples show."""

from collections.abc import Callable

import numpy as np

from rig.record import Column

Change = Callable[[Column, np.random.Generator], Column]


def repeating(share: float) -> Change:
    """This share of the samples is lost, and shows the one before."""

    def repeat(angle: Column, random: np.random.Generator) -> Column:
        lost = random.random(len(angle)) < share
        lost[0] = False
        return angle[np.maximum.accumulate(np.where(lost, 0, np.arange(len(angle))))]

    return repeat
