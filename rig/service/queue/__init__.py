"""The daemon's jobs: sweeps that wait, are expanded, run one after the other, and tell what became of them."""
