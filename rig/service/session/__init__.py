"""One arming of a rig: its processes from start to end, who watches them, and who sees to the safe state when one is
lost."""
