"""The nominal equations, each once, in plain Python that a controller can run and numba compiles."""
