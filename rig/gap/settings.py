"""Every number that decides in the likelihood and in what an answer keeps of it: with its unit, its source, and what
moves if it moves. The numbers of records, raw-data tests, plans and words stand in the `settings.py` of those rooms.

What is a choice stands here. What can be fitted stands in `priors.yaml` beside this file, written by the commands of
docs/how-to/refit_the_priors.md, each part with its provenance, and is read by `rig.gap.priors`.
"""

TOP_HZ = 6.0
"""Highest frequency compared, Hz: muscles and regulators answer below it. Higher: more lines of noise, the same
evidence."""
ENVELOPE_HZ = 0.5
"""Width over which a response's power is blurred for the residual's variance, Hz. Narrower: single lines decide."""
LOUDER_BELOW = 3.0
"""A monitor's noise below TOP_HZ has at most this many times the power of that in the octave above. More: what a
description misses of a rig is taken for noise where there is little; less: noise that falls with frequency stays, and
filters fit better than delays by smoothing it."""
ENVELOPE_EVEN = 0.1
"""Share of that power that is spread evenly over all lines. Less: effects between the excited lines count for more."""
SESSION_S = 140.0
"""Length of the sessions (seven records of 20 s) for which `Prior.effective` lines are independent; shorter ones have
fewer. Longer: short records are believed less."""
LEAST_EFFECTIVE = 20.0
"""Independent lines that a single short record has at least; as surely a rig's own records say how much its simulator
misses. Fewer: nothing is seen in one record of some seconds, and a simulator that misses several times as much as it
does of its own records lacks nothing."""
UNKNOWN_EVEN = 0.3
"""Share of the power of something unknown that is spread evenly over all lines, as ENVELOPE_EVEN is for the residual.
Less: what is unknown must lie where the gap is largest."""
UNEVEN_CODES = 1.3
"""What rounding leaves is larger than an even converter's by this factor: codes differ in width (development: 1.1 to
1.3)."""
MEAN_DOUBT = 0.3
"""What is not known of the law of the mean pressure where that is another than expected: standard deviation of its
exponent, which lies between 0 and 1, and of what it is more, or less, at the ends of the motion. Healthy days never
show it, so no fit of theirs can say it. Less: a stiffness, or a bent reading, is named beside every cause that shifts
both pressures."""
FRICTION_DOUBT = 0.5
"""The same of the joint's friction over its stiffness: friction of the bearing stays while the stiffness rises (an
exponent of -1), a braid's rises with it (0). Less: as there."""
VOLUME_DOUBT = 0.3
"""Relative change of a muscle's volume over the joint's span (a McKibben muscle that contracts by a fifth grows by
about as much; Chou and Hannaford, IEEE Trans. Robot. Autom. 12, 1996): a joint that moves otherwise than expected
pushes air back to its regulators. Less: a change of the joint is called something unknown of the valves as well."""
SPEED_DOUBT = 1.0
"""Standard deviation of the relative change of a regulator's time constants, over that of the absolute pressure that it
holds: choked, the pace at which air leaves goes with the pressure, that at which it comes not at all (ISO 6358). Less:
a lag or uneven filling of some milliseconds is named beside every cause that shifts the pressures. More: regulators
that are slower as well are not, where the pressures are off."""
PATTERN_DEGREES = 2.0
"""Degrees of freedom that the population's spread of a pattern is worth beside a rig's own days, each of which brings
one. More: the own days count for less."""
RIG_DEGREES = 4.0
"""Degrees of freedom with which it is known beside one earlier day by how much the days of this rig differ more or less
than those of others (by 1.4 times either way), each further day bringing one; from development cases
(docs/decisions/0560). Fewer: a gap of many floors passes for a rig of unlike days. More: such a rig is given a
cause."""
LINE_DEGREES = 6.0
"""The same for the variance of a line, once the rig's own level is known."""
DAY_DEGREES = 20.0
"""Degrees of freedom of the level of one further day beside the days of the same rig: healthy days of a rig are alike
(on three plant families their mean chi-square a line stays within a factor 1.5 of its median). Fewer: something unknown
is sooner taken for a noisy day."""
CREDIBLE = 0.95
"""Mass that the reported set of names holds."""
WIDTH_SHARES = (3.0, 0.05)
"""A law's further numbers are flat over this many times their value, at least over this share of their bounds. Wider:
laws with more numbers lose."""
FIT_STEPS = 6
"""Gauss-Newton steps of a law from the best point of its grid; more change no name on the development cases."""
UNSEEN_MEAN_LAW = 0.5
"""Standard deviation of the exponent of the mean pressure at mean pressures that a reference never saw. Published
muscles and the plants here lie between 0 (only the difference counts) and 1 (the difference over the mean). Smaller:
another P0 looks like another gain."""
ZERO_BY_HAND = 0.05
"""Standard deviation, as a share of the angle's span, of where the zero of another rig of the build lies, which is set
when the sensor is mounted, to some degrees. Smaller: every sister's simulator lacks an offset."""
ZERO_AT_REST = 1.0
"""The same of each record's where the loop took the angle at rest for zero: wherever a joint may come to rest. Smaller:
what turns the joint at rest brings a second cause; larger changes nothing."""
GAIN_BY_DAY = 0.0024
"""Standard deviation of a regulator's gain between two days of which no third tells more: the ITV's 0.12 % of full
scale a kelvin, over the two kelvins that a room's days differ by. Smaller: a warmer day is another gain of the valves;
larger: gains of half a percent are no finding."""
MOST_MISSED, MISSED_STEPS = 2.0, 21
"""Logarithm of the largest share of the usual by which a simulator's class may miss a build, and how many are tried up
to there. Less: a build that is missed by more is given a cause."""
MOST_ROUGH = 0.6
"""A law that leaves more of its own change than this says nothing: no law counts as rougher. More: a rough law stands
for whatever nobody knows."""
STILL_LIKELY = 0.02
"""Hypotheses ahead of the monitors of at least this probability are judged by the angle as well: what a valve does
reaches the joint, what a monitor misreads does not. Less: one angle more to judge, seldom another name."""
FAINT = 1e-4
"""Hypotheses ahead of the monitors down to this probability are judged by the angle as well, if they imply another
monitor offset than the likeliest: an effect costs some nats beforehand, and the angle may say more than that."""
MOST_FAINT = 3
"""Of those, the likeliest so many. More: slower."""
POSSIBLE = 1e-3
"""Effects behind the monitors of at least this probability go into that trial."""
ANOTHER_RIG = 0.3
"""A model that misses the earlier days by this share of the angle's spread is no simulator of this rig."""
UNSURE_ROUNDS = 4
"""How often what is unsure of a simulator is taken anew beside a cause at most; once or twice is usual."""
UNSURE_STANDS = 0.1
"""The patterns of the simulator's unsure numbers are taken anew (linearised) until their relative sizes change by less
than this; where they never do, those without a change are kept."""
FASTEST_REGULATOR = 0.1
"""Of the simulator's, the least time constant that is tried: no rig of a build is ten times as fast as another."""
FIRST_LAW_SHARE = 0.3
"""How rough the first cause's law is taken to be, in its usual error."""
LAG_SAID = 0.5
"""Unsure lags of more than this share of the simulator's step are said."""
RUNS_OFF = 1.0
"""A simulator that is off by more than so many times what the joint moves (rms) says less than the mean angle does."""
OUTSIDE_SEEN = 0.1
"""Share of the drive's span by which records may leave what the fingerprint has seen before it is said."""
USUAL_HZ = 0.8
"""Fastest excitation of the usual session, on which levels are fitted: a slower session makes no record a fast one.
Lower: usual records after a slow session are doubted."""
EXCITED_POWER = 0.95
"""Share of a command's power below the frequency that counts as its fastest. More: harmonics of triangles count."""
BEYOND_DAYS = (3.0, 10.0, 30.0, 100.0)
"""Factors by which the patterns that may differ without being a gap are enlarged, as one form of something unknown."""
EVEN_CHANCE = 0.5
"""Probability of none below which there is something."""
FIRSTS_TRIED = 3
"""Likeliest single effects that are tried as the first of two. More: slower, and a pair whose parts both look like a
third effect is found more often."""
ABOVE_FLOOR = 1.2
"""A gap counts as above the floor from this ratio on; below it, what is explained is counted from zero, and something
unknown, by itself or beside a name, is a note. More: less is said to be unknown, or only partly explained."""
LARGE_GAP = 3.0
"""Floors from which on a gap is large, whatever is found: what closes nothing of one does not explain it; beside a
simulator nothing is no answer to one, and a name that leaves one is not all there is; a model that misses the healthy
rig by as much is worth a line. More: a valve's fault passes for all that is wrong, and what nobody knows for what
simulators miss."""
EITHER_CHANCE = 0.5
"""Probability that is left of a name where something that is no hypothesis may have done the same. More: a clipped
sensor or another P0 takes less off a confidence."""
LEAST_CLOSED = 0.02
"""Share of its own factor's gap that a named effect closes at least: less reads as "loses 0 % of its pressure", and
something unknown is there."""
LEAST_EXPLAINED = 0.5
"""Share of the degrees (rms) by which a gap stands above the floor that causes close at least where they are said to
explain it; with less something unknown makes up the larger part. More: rough laws explain nothing."""
BEHIND_CLOSES = 0.5
"""Share of the gap beside the measured pressures (mean square) that an effect behind the monitors closes at least where
it stands whatever the simulator says of it under the commands. More: it falls to a rough law of the valves; less: it
stays where the simulator is worse with it."""
SPOILT = 1.02
"""A cause that leaves more than this share of the rms in the simulator is not added to it."""
FALSE_ALARM_RATE = 0.01
"""How often something is said of a rig with nothing wrong: by a whole diagnosis, at the sizes that a rig can tell; by
the changes of a history, all its series together. Less: larger sizes, later and larger changes only."""
