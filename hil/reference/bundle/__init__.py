"""The fifth family: bundles of thin braided strands on toothed belts, analogue regulators with piezo benders.

The angle is read from a rotary transformer behind a sigma-delta converter. No law is shared with the other families,
and no line but what every family's rig does alike. Written from physics and the literature alone, for judging, which it
did until there was `airbeam`. `physics` holds the parameters of the healthy rig and what days bring, `pneumatics`,
`strands` and `mechanics` its compiled equations, `timing` and `sensing` what happens to set-points and readings on
their way, `disturbance` everything that can be wrong, `other_laws` every effect as a sixth law, `plant` puts the rig
together.
"""
