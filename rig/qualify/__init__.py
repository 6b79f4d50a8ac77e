"""Is it good enough: benchmarks, fault trials, a soak, and which stalls were the machine's. For developers and for who
installs it."""
