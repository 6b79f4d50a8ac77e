"""Causes through the frozen response of the healthy rig: `nominal` describes it, `propagate` says what its records
would have been with a cause in it. In differences only: the description's own misfit cancels."""
