"""Simulators that are not ours: a Python function, or an FMU, in the place of the muscles."""
