"""How large an effect has to be for the gap that is wanted."""

import math
from collections.abc import Callable


def reach(ratio: Callable[[float], float], wanted: float, weak: float, strong: float) -> tuple[float, float]:
    """Where between `weak` and `strong` the rising `ratio` is `wanted` within 5 %, by false position of logarithms,
    halved when it creeps; `strong` itself when even that is less.
    """
    place, reached = strong, ratio(strong)
    if reached <= wanted:
        return place, reached
    low, high = -3.0, math.log(reached / wanted)
    for turn in range(10):
        share = 0.5 if turn % 3 == 2 else min(0.9, max(0.1, -low / (high - low)))
        place = weak + share * (strong - weak)
        reached = ratio(place)
        off = math.log(max(reached, 1e-9) / wanted)
        if abs(off) < 0.05:
            break
        if off > 0.0:
            strong, high = place, off
        else:
            weak, low = place, off
    return place, reached
