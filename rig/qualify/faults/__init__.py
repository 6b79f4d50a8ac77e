"""Faults done to a rig in real processes: each has to end in the safe state, for the right reason, in time, with its
evidence kept."""
