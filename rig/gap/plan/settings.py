"""The numbers that decide which records are recommended, what a session is designed for, and what a rig is said to
tell."""

# The next experiment
LENGTHS_S = (10.0, 20.0, 40.0)
"""Of records that are tried: what is slow (creep, a staircase's holds) needs long ones. More: slower."""
TIME_S = 60.0
"""That an experiment may take on the rig."""
WORTH_NATS = 0.05
"""An experiment that tells less is not worth the rig's time."""
MORE_NATS = 0.02
"""A further record that tells less is not worth its time. More: shorter experiments."""
LEAST_PROBABILITY = 0.01
"""Hypotheses below are not designed for."""
MOST_HYPOTHESES = 6
"""Hypotheses at a time, the likeliest first."""
TOLD_APART = 2.0
"""Standard deviations, as they count at the temperature of names, from which two hypotheses count as told apart by the
records to come: odds of 7 to 1 are expected between them. More: fewer names are promised to be parted."""

# Information
MOST_SEPARATION = 1e6
"""Standard deviations: where the search for a needed separation ends."""
ONE_DIRECTION = 0.98
"""Correlation from which two directions are one. Less: laws that differ are taken for one; more: slower."""

# Candidates
MOST_SWING_MPA = 0.4
"""Largest amplitude of dp that is recommended, however far the records at hand went."""
SETTLE_S = 3.0
"""Rest before each record, as in the sweep that a hunt begins with."""
PEAK_OF_MIXED = 2.4
"""Of equation (12), in its A."""

# Planned records
ANGLE_MARGIN = 0.05
"""Of the range between two limits, by which an expected angle keeps away from either: a rig does a little more than is
expected of it. Less: records that end in a fault. More: smaller records."""

# A designed session
LEAST_SCORE_GAIN = 0.001
"""Of the score, that a further record adds at least. More: shorter sessions. Less: records that tell nothing."""

# What a rig can tell
CHANCE = 0.9
"""With which an effect of the said size is seen, or named. More: larger sizes."""
NAMED = 0.95
"""Probability against its nearest rival from which an effect counts as named."""
