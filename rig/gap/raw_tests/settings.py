"""Every number that decides in the tests on the raw samples: unit, source, what moves if it moves.

"Development" names cases of the reference plant that are never scored, and the practice set.
"""

STANDS_OUT = 5.0
"""Standard deviations by which a share or a level must stand out. TESTS tests on every case at 5 leave one false
one in 10^5 cases by chance; days that differ more than their spread says are why it is not 3."""
TESTS = 12
"""Tests made on every case: what a single p-value is multiplied by (Bonferroni) in the confidence that is stated."""
HIGHEST_CONFIDENCE = 0.99
"""No test excludes what it was not made for; development: 97 to 100 % of what was found was right."""
PRIOR_DEGREES = 2.0
"""Degrees of freedom that the prior spread of days counts for, beside the days at hand."""

# quantisation step
LEAST_GAP = 0.2
"""Neighbouring values nearer than this share of their usual distance are one value, rounded twice."""
STEP_DIGITS = 7
"""Decimals of a degree that a file keeps."""
COARSER = 1.6
"""A step is a finding from this many times the baselines' on: a converter loses whole bits, a factor of 2. Lower:
uneven codes count."""
LEAST_STEP_DEG = 1e-3
"""Below, a step is how the file was written."""
STEP_BY_CHANCE = 0.001
"""Values lie so near to whole steps by chance at most so often. Without it, samples that repeat leave few enough values
to pass for a converter's."""
FINE_STEPS_APART = 4
"""Values up to so many steps apart are looked at for a converter that is too fine for its values to come twice. More:
what a file rounds adds up."""
LEAST_APART, WHOLE_STEPS, OFF_WHOLE = 20, 0.9, 0.15
"""So many of them there must be, and this share of them whole steps apart, up to this share of a step. Without a
converter some 5 are, 0.3 of them so."""
STEP_OVER_NOISE = 6.0
"""Without baselines a step must exceed the noise beside it by so much: every converter has one, and is chosen so
that it is of about the noise. Lower: the step of a usual converter is a finding."""
CODES_APART = 0.8
"""A converter cuts off towards zero where that follows the readings so many times as closely as the nearest code does.
Higher: day-to-day differences decide."""
HALF_STEP_LOW = 0.1
"""A zero that is half a step too low within so many steps is a converter that cuts off, not a zero."""
SMOOTHED_VARIANCE = 0.25
"""Share of a white disturbance's variance that the smoothing lets through, generously (a Gaussian of 12 ms at 5 ms:
0.12)."""

# repeated samples
SLOPE_ROWS = 6.0
"""Standard deviation, rows, of the smoothing under which the slope is read."""
SLOPE_S = 0.02
"""The same in s at most, where noise is told from motion. Longer: motion is smoothed, too, and passes for noise in rows
that are 40 ms apart; shorter: noise passes for motion from 30 ms on."""
MOVING_STEPS = 1.2
"""A row moves when it goes on by more than so many quantisation steps: below, repeats are what a converter does."""
MOVING_QUANTILE = 0.4
"""The slowest share of rows is not looked at: joints rest at turning points."""
LEAST_MOVING = 200
"""Rows that must move before repeats among them count."""
SPEEDS_PER_DOUBLING = 2
"""Classes of speed to a doubling: repeats by chance fall with the speed, so each class has its own expectation."""
SPEED_CLASSES = 14
"""Classes of speed; the last holds what is faster."""
LOST_CLEAR = 4.0
"""Standard deviations for repeats, 3 in 10^5: less than STANDS_OUT, because the jump after them is a second,
independent sign."""
LEAST_REPEATING = 0.001
"""No class of speed is believed to repeat more seldom by chance: it bounds the weight of the fastest rows."""
MOST_REPEATING = 0.999
"""A class of speed in which all repeat by chance says nothing; this keeps it finite."""
LEAST_LOST = 0.002
"""Share of lost samples below which none are reported: 8 of a 20 s record."""
LOST_MORE = 0.25
"""Repeats must exceed those by chance by this share of them: chance itself is known to about a tenth."""
CHANCE_SPREAD = 0.1
"""How well repeats by chance are known without two baseline days, as a share of them."""
SURROGATES = 5
"""Surrogates of a case in which repeats by chance are counted: so many times its rows. Fewer: chance
itself passes for lost samples, 0.5 % of them in a noise of twenty steps; more: slower by 15 ms each."""
LOST_JUMP = 1.5
"""Steps that must go on for each repeat: 2 after lost samples, 1 in a dead spot. More: lost samples pass for a dead
spot."""
LOST_PLACE = 0.4
"""Distance between the angles at which rows repeat and those at which they move (Kolmogorov): 0.5 at least for one dead
spot, beyond 0.4 by chance for 20 lost samples once in 500. More: dead spots pass for lost samples."""
MOST_LOST = 0.9
"""Largest share that the effect's stage takes."""
GOES_WITH_LOST = 0.75
"""Of the record's period: rows of another record that lie so close to a lost sample are bridged with it. Less: some of
them stay where it is sampled faster; more: neighbours go as well."""

# noise
UNEVEN_ROWS = 0.2
"""Share of a period by which rows may be off and still be as far apart as a fingerprint's noise was measured on: what
they show of the motion then is taken off. More: rows are missing, and what a straight line says of the motion is not
enough."""
NEARLY_ALL_EVEN = 0.95
"""Of the rows, so many: a level of noise is a median, to which few rows are nothing."""
NOISE_WINDOW_ROWS = 7
"""Running mean whose rest shows noise that a filter has coloured."""
ROWS_NOISE = 1.5
"""Relative standard deviation of a level of noise from n rows, times the square root of n: that of a median of third
differences of white noise."""
LEAST_LOUDER = 0.2
"""Least difference of the levels' logarithms that counts: noise 22 % up. Lower: warm-up and cables count."""
DAYS_NOISE = 0.03
"""Prior spread of the logarithm of the level between days (practice set: 0.01 to 0.04)."""
MOST_HEAVY = 4.0
"""Most by which heavy tails may raise a level above what medians say."""

# spectral lines
LINES_HZ = (50.0, 60.0)
"""The mains."""
LINE_WIDTH_HZ = 0.6
"""A line is looked for within this distance: the mains wander by 0.2 Hz, a record of 5 s resolves 0.2 Hz."""
BESIDE_FROM_HZ, BESIDE_TO_HZ = 1.0, 8.0
"""What lies at this distance from a line is what it is compared with."""
LOWEST_LINE_HZ = 8.0
"""Where sampling folds the mains below this, the motion hides it."""
HIGHEST_MARGIN_HZ = 1.0
"""Distance from half the sampling rate."""
LEAST_AMPLITUDE_LEFT = 0.1
"""Share of an amplitude that is left once the motion is taken off, from which on it is told as it was: 0.17 at the
lowest line."""
LINE_CLEAR, LINE_MORE = 6.0, 2.0
"""How many times a line's amplitude must exceed what lies beside it, and the baselines'. 6 times the median amplitude
is p = 10^-11."""
LINE_ALONE = 2.0
"""... and every single line beside it, where lines are looked for: noise reaches half of LINE_CLEAR there. Less: the
flank of a resonance near the mains (of a sensor's mount, 11 Hz in rows 40 ms apart, where 60 Hz show at 10) is one."""
TONE_FROM_HZ, TONE_AROUND_HZ = 20.0, 8.0
"""Spurious tones are looked for above the motion's own lines, and compared with what lies within so much around
them."""
TONE_CLEAR, TONE_ALONE, TONE_MORE = 6.0, 3.0, 2.0
"""As LINE_CLEAR; and by how much it must exceed every other line (the motion's multiples come in rows), and the
baselines'."""
MAINS_MULTIPLES = (1, 2, 3, 4, 5)
"""Multiples that belong to the mains: taken off with its line where they stand out, and no spurious tones."""
SIDEBAND_FROM_HZ, SIDEBANDS_ALIKE = 0.3, 0.5
"""Sidebands of a line that comes and goes are at least so far from it, and alike in power by this share: a Hann window
loses up to 0.28 of it between its rows. Lower: neighbours in the noise pass for pairs."""
SWITCHED = 0.2
"""Share of its sidebands' mean square that a line leaves beyond BESIDE_TO_HZ, when it is switched on and off as fast as
that resolves; less is no noise of its own."""
HANN_BINS = 1.5
"""Rows of a spectrum under a Hann window that the power of one line fills (its equivalent noise bandwidth)."""
HANN_LOBE = 2.0
"""Half of the width of its main lobe, in rows."""
HANN_LOSS = 0.33
"""Logarithm of the power that a line half way between two rows of a Hann spectrum loses (1.42 dB): the most that is
made up for."""
NOTCH_WIDTH_HZ = 4.0
"""Width of the notch that takes a line off, at 3 dB. Wider: noise goes with the line; narrower: a line that wanders
stays."""

# drop-outs
DROPOUT_CHANCE = 1e-4
"""Probability by chance below which drop-outs are found, given as many as the baselines have."""
BASELINE_FALLS = 0.05
"""Samples that are taken to fall in a healthy session, where baselines have none: in 119 sessions of reference plants
and practice rigs none fell, by which it is 0.004 (Jeffreys); ten times that, for sensors that nobody has seen. More:
three falls from far away, which no joint can move by, are chance. Where baselines have some, bursts are counted: their
samples fall together."""

# time stamps and monitors
STAMP_GAP = 2.5
"""Periods without a row that are a gap."""
JITTER = 0.1
"""Standard deviation of the periods, as a share, that is a finding."""
DAYS_MEAN_MPA = 5e-4
"""Prior spread of the mean pressure between days: 0.5 kPa, a regulator's repeatability."""
BELOW_ZERO_MPA = -0.02
"""A monitor that usually reads less has no sensor behind it: 4-20 mA without current reads -0.125 MPa on a range of
0.5."""
