"""Play without a memory of its own: what follows rests until it is pushed. How wide it is, each family says."""

import numpy as np

from hil.reference.compiling import Array, compiled


@compiled
def dragged(angle_deg: Array, half_deg: float) -> Array:
    """(n,) where what follows is: as it was until a flank pushes it."""
    out = np.empty_like(angle_deg)
    follower = angle_deg[0]
    for k in range(len(angle_deg)):
        follower = min(max(follower, angle_deg[k] - half_deg), angle_deg[k] + half_deg)
        out[k] = follower
    return out
