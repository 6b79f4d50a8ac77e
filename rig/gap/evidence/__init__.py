"""The hypotheses of one factor weighed: nothing, each effect of the library, two of them, or something unknown. What
fits them is `rig.gap.hypotheses`, what weighs them `rig.gap.likelihood`."""
