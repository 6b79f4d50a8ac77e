"""Every number that decides which records and rows can be used and what pairs with what: unit, source, what moves if it
moves."""

import math
from collections.abc import Mapping
from typing import Final

CLIPPED = 0.1
"""A column that stands at its end for more than this share of the time is said to be clipped."""
CLIPPED_OVER_NEXT = 4.0
"""... if it does so this many times as long as at the value next to it. Less: turning points on the steps of a coarse
converter count; more: a clipped sensor with such steps does not."""

LONGEST_BURST_S = 0.25
"""Samples at a rail for longer are no drop-out but a sensor that is cut off or gone, s. Longer: an end stop of a fast
sweep may count."""
OWN_STEPS = 2.0
"""A drop-out jumps by more than this many times the largest step that the record takes elsewhere: a joint has mass and
cannot. Lower: heavy-tailed noise counts; higher: falls from near the rail are missed (their share is computed from the
others)."""
RECOVERY_ROWS = 3
"""Rows in which a filter behind the sensor comes back after a fall; they are taken out with it."""
RETURNS = 0.15
"""After a drop-out the sensor reads what it read before, within this share of the jump: a filter is not back before,
..."""
MOST_MOVED = 0.5
"""... or within what the joint can have moved meanwhile, but at most this share of the jump: a square wave does not
come back."""
FEWEST_ROWS = 3
"""Rows of a column in which a fall and its two sides fit."""
FEWEST_VALUES, MOST_DIFFERENT = 3, 0.5
"""Different values, as a number and as a share of the rows, between which a column has a converter's step."""
SAME_SHARE = 1e-9
"""Share of a column's range within which values without such a step are the same."""
FEWEST_DROPOUTS = 3
"""Samples that fell to one rail from which on they are drop-outs and not outliers; 0.5 % of two 20 s records are 40."""
OUTLIER_ROWS = 3
"""Samples in a row that may be one outlier. More: a joint that snaps and comes back is left out."""
SPREAD_QUANTILE, FAR_OUT = 0.99, 8.0
"""An outlier stands this many times further from its neighbours than all but the largest hundredth do: beyond twenty
standard deviations of normal noise, eight steps of a converter. Fewer: heavy-tailed noise loses its tails; more: pulses
stay in."""
MOST_OUTLIERS = 2e-3
"""Share of a column from which on what stands out is noise and no outlier, and stays. More: an effect that scatters
samples is cleaned away."""
RAIL_STEPS = 2.5
"""A converter reads a rail within so many of its steps: one either way, counted from the lowest."""
RAIL_NOISE = 7.0
"""... or within so many standard deviations of the column's white noise: a hundred samples spread over five, counted
from the lowest. Fewer: falls are missed where a sensor is read with noise; more: a joint that passes zero seems to rest
there."""
MOST_FALLEN = 0.3
"""Share of a record's rows from which on they are no falls: a square wave is at either end for half of its time."""
ABRUPT = 6.0
"""Steps of more than so many times the usual one (median of those that are any) are abrupt; a joint on a sine takes 1.4
times that."""
FEWEST_ABRUPT, MOST_UNLIKE = 8, 0.05
"""How many of them must die away before a filter is believed, and how unlike their shares may be (quartiles apart): a
filter's are alike within 0.03, a joint's own way after a step of the command is of more than one time constant."""
PASSED_TO = 0.02
"""Share of the range within which falls agree once a filter is undone that is known to a percent, and beyond which no
noise of a sensor reaches. More: a fast joint that is sampled seldom falls to its turning points."""
OPEN_KEEPS_LEAST, OPEN_KEEPS_MOST = 0.05, 0.9
"""Shares of its distance to a rail that an open input keeps from row to row: less is a fall to the rail itself, more a
joint's own way."""
OPEN_AGREE = 0.8
"""Share of the falls that must lie on one line over what was read before them; of two in a row the second may not."""
LONGEST_BRIDGE_S = 0.05
"""Missing samples up to this long are bridged by a straight line, s; longer ones count as a hole. A line misses a sweep
of 20 deg at 1 Hz by 20 (2 pi)^2 0.05^2 / 8 = 0.25 deg in the middle of the longest bridge, 10 deg in one of 0.3 s."""
LONGEST_GAP_S = 0.25
"""What was commanded in a hole up to this long is a straight line where nobody knows it, s; after a longer one see
WIPED_OUT. Nor are two commands compared in a longer one. A sine of 0.8 Hz is off its chord by a fifth of its
amplitude in the middle."""
WIPED_OUT = 0.9
"""Share of its range that a command goes through after a hole before rows count again where nobody knows what was
commanded in it. Higher: less of a record counts; lower: what a hysteresis remembers of the hole looks like a gap."""
SETTLED = 0.25
"""... and so much later, s: six lags of a regulator."""

SHORTEST_S = 2.0
"""A record shorter than this is not used, s: no effect that is slow shows in it."""
LEAST_SAMPLED = 0.5
"""Share of its own time that a record has to be sampled: rows times their usual distance, over its length."""
LEAST_MEASURED = 0.5
"""Share of a record's rows in which the angle must have been measured."""
LEAST_COMMAND_MPA = 0.005
"""A command (p1 - p2) that moves by less excites nothing, MPa: a hundredth of a regulator's span."""
STILL_DEG = 1e-6
"""An angle that moves by less does not move at all, deg: far below a converter's step."""
AGAINST, ALMOST = -0.9, 0.97
"""Correlation of the measured with the commanded p1 - p2 below which the two sides are swapped, at the first lag at
which it is almost (this share of) the largest of either sign. A later lag: a sine half a period late is mirrored."""
ANGLE_AGAINST = -0.7
"""Correlation of all records' angles with what is expected below which the sign is turned: a rig that is late by a
third of a period is still above -0.5."""
SPREAD_IN_RADIANS = (0.75 * math.pi / 180, 1.25 * math.pi / 180)
"""An angle that spreads by this share of the baseline's is the same angle in radians."""
STRANGE = 4.0
"""A model that moves this many times as far as the rig, or as little, is no reference."""
UNIT_SHAPE = 0.8
"""Correlation, at the best lag, from which on a motion is another one in another unit. More: an angle in radians under
strong friction is taken for a joint that is held."""
HALF_TURN_DEG = 180.0
"""No joint between two muscles turns farther: a model that does has left its range."""
FARTHEST = 4.0
"""An angle that spreads by so many times the baseline's is another rig's or in another unit: no effect of the library
reaches so far. Less than the baseline's may be a joint that is nearly stuck."""
MOST_REASONS = 3
"""Reasons that are told when no record can be used."""
LEAST_REST_MPA = 0.02
"""The least P0 that is believed where it is measured, MPa."""

ODD_RATIO = 3.0
"""An earlier day is odd when it is so many times farther from the others than they usually are from each other. Less:
healthy days are left out (of 117 of 27 development rigs one at 3)."""
ODD_CHANNELS: Final[Mapping[str, tuple[float, str]]] = {
    "angle_deg": (0.3, "deg"),
    "p1_mpa": (0.003, "MPa"),
    "p2_mpa": (0.003, "MPa"),
}
"""What of two days is compared, and the rms difference (after the mean) below which no two are called different: about
what monitors resolve."""
TWO_APART = 0.05
"""Two days alone are said to differ from this share of the angle's spread on: days of one rig differ by less than half
of it."""

SAME_COMMAND = 0.1
"""Two commands are the same sweep when they differ by less than this share of the command's spread (rms and mean),
aligned in phase. Higher: a sweep 10 % larger counts as the same; lower: a session at another amplitude pairs with
nothing."""
ALIGNED = 0.002
"""Commands that differ by less than this share of their spread need neither a shift nor a change of input: 1 sample of
5 ms at 0.06 Hz."""
MOST_SHIFT_S = 1.0
"""Most by which a start may be shifted, s; a periodic command by half its period. Higher: slow sweeps of other shapes
are slid together."""
ALIGN_STEP_S = 0.01
"""Step of the search for the shift, s; a parabola through the best three goes below it."""
OVERLAP = 0.6
"""Share of the shorter record that must be left when one is shifted."""
LEAST_COVERED = 0.5
"""Share of the overlap in which both must have been sampled for their commands to be compared."""
LEAST_COVERED_SAID = 0.9
"""Share of a record that what it is compared with must last for nothing to be said; a fingerprint's own records that
last less stand for nothing, because its response model knows every second."""
SHIFT_HELPS = 0.5
"""A shift is taken when it leaves less than this share of the difference: noise of a measured input is no reason to
slide it."""
SPREAD_FACTOR = 3.0
"""Commands whose spreads differ by more than this many times SAME_COMMAND are not slid against each other: it only
saves time."""
PERIODIC = 0.97
"""Correlation of a command with itself a period later from which on it is periodic."""
PERIOD_PAST = 0.3
"""Correlation below which a period's own first part is over."""
FEWEST_PERIODS = 3
"""Periods that a command must hold to be called periodic, and to be cut to whole ones."""
CONDITION_LIMITS = {"p0": (0.01, 0.0), "load": (0.0, 0.05), "tension": (0.0, 0.05), "temperature": (5.0, 0.0)}
"""What a record's condition may differ by and still be the same: name -> (in its unit, as a share of the larger). P0 in
MPa: what the set-point of a regulator differs by between days; temperature in K; load and tension as a share: a weight
is weighed to a few percent."""
LEAST_KEPT = 0.5
"""Share of the records that must be of a sweep that a fingerprint keeps to be compared with that, the others left out.
Fewer: all are compared with what its response model expects, which knows every sweep, and none as well."""
INPUT_TAPS, INPUT_TAP_S = 8, 0.03
"""Taps of the response by which a baseline is propagated to the case's own input, and their distance, s: 0.24 s, six
regulator lags."""
INPUT_RIDGE = 1e-6
"""Ridge of that fit as a share of the input's power: a single sine says nothing of other frequencies."""
STUCK_S, STUCK_ROWS = 0.25, 50
"""A monitor that shows one value for so long, and for so many rows, while its set-point moves was not read. More:
shorter stretches pass for a regulator that stands; less: chance passes for a hang (0.6 to the power of 50 is
10^-11)."""
LEAST_FLICKER_STEPS, LEAST_FLICKER_MPA = 0.5, 3e-5
"""White noise, in the converter's own steps and in MPa, with which a monitor repeats a value in two rows of three at
most while its pressure stands. Less: one without noise that stands rightly, behind a dead band, is left out."""

FIRST_ROWS = 3
"""Rows by whose median a record begins at an angle: before the joint has moved. More: a fast sweep has left its zero;
fewer: one fallen sample decides."""
TELLS_A_START = 1e-3
"""Widest code of an encoder, as a share of the farthest motion, by which records are seen to begin at zero: coarser
sensors are as near to it by themselves. More: they seem to count from rest; less: only fine encoders are seen to."""
