"""What input and output of a rig are called on the page, and in which units."""

from typing import Any, Final

from rig.channels import Channels

LOOP_MARGIN_MPA: Final = 0.01
LOOP_MARGIN_DEG: Final = 0.5
"""Margins of a loop on the working range: a few times the noise of monitor and potentiometer."""


def units_of(own: Channels) -> dict[str, Any]:
    """Plain data: `valves` (two pressures make the input), name and unit of each, and what a plot of the one over the
    other leaves around it at least."""
    pneumatic = own.has_valves
    return {
        "valves": pneumatic,
        "input": "p1 − p2" if pneumatic else own.input.spoken,
        "input_unit": own.input.unit,
        "output": own.output.spoken,
        "output_unit": own.output.unit,
        "least": [LOOP_MARGIN_MPA * own.input_per_mpa, LOOP_MARGIN_DEG * own.output_per_deg],
    }
