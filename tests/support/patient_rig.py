"""A rig's YAML for fault benches whose tests ask about no matter of milliseconds."""

import re

from rig.qualify.faults.bench import RIG

PATIENT = re.sub("limits: .*", "limits: {{misses_per_s: 1000, stall_periods: 1000}}", RIG)
"""A machine that stands still for seconds stops no such rig."""
