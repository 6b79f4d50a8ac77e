"""The numbers that decide what an answer tells: of re-tuning, of where the gap lies, and how surely."""

# Re-tuning
PLAIN = 2.5
"""Standard deviations by which a parameter must move to be told."""
COLOUR_S = 1.0
"""Residuals of a simulator are coloured over about so long: what lies closer counts once."""
USEFUL = 0.9
"""Re-tuning that leaves more than this share of the mean square on other records moved nothing worth telling; nor did
parameters that close less than the rest of it of what all close."""
LEAST_MOVE = 0.01
"""Relative moves below this are none, whatever their standard deviation says."""
RETUNED_ALIKE = 0.5
"""Share of the mean square of what re-tuning closes from which on an effect, re-tuned away, is the same; and of an
effect's own that re-tuning must absorb."""
WIDE = 20.0
"""Scales by which a parameter may move at most."""

# What re-tuning absorbs
ABSORBED_SHARE = 0.5
"""Share of the mean square from which on re-tuning is said to close a gap."""

# The law of the mean pressure, in an augmented model
MEAN_EXPONENTS = (0.6, 0.7, 0.8, 0.9, 1.0)
"""Laws of the mean pressure that are tried: d = (p1 - p2) (2 P0 / (p1 + p2))^exponent; 1 without, less with passive
stiffness."""
MEAN_MOVED = 0.01
"""Shares of change of the mean pressure below this are none."""

# Observations
LEAST_SIGNATURE_SHARE = 0.05
"""Share of the raw records' mean-square gap from which on a signature explains some of it. Less: small steps and hums
are named beside any cause; more: a real second cause in the samples is told as a remark."""

# Where the gap lies
SLOW_SHARE = 0.33
"""Share of the rows, the slowest ones, that are at a turning point."""
EXCITED_SHARE = 0.15
"""Of a command's largest line, from which on another is excited as well."""
STEP_SHARE = 0.5
"""A step in the residual counts when it holds at least this share of the residual's mean square."""

# Words
SURE = 0.9
"""From here on nobody asks what the rest is given to."""
WORTH = 0.25
"""Share of that rest from which on a rival is named."""

SOFT_STOP = 0.1
"""Share of the motion that a stop gives way by from which on it is told: the joint goes on beyond it."""

# Words of re-tuning
LEAST_TOLD = 0.05
"""Part of what re-tuning closes from which on a number is told behind a move. Less: numbers that nobody needs."""
AS_MUCH = 0.05
"""Shares of the error that differ by less than this are told as the same."""
