"""A rig's YAML for fault benches whose tests ask about no matter of milliseconds."""

import re

from rig.qualify.faults.bench import RIG

PATIENT = re.sub("limits: .*", "limits: {{misses_per_s: 1000, stall_periods: 1000}}", RIG)
"""A machine that stands still for seconds stops no such rig."""

BY_THE_MACHINE = ("MISSED_TICKS", "LONG_STALL", "LOOP_DIED")
"""Faults that one which stands still longer brings all the same."""
