"""The second family: membrane muscles on a lever, sampled PI regulators behind a hose, Dahl hysteresis, an incremental
encoder.

No law is shared with the first family, and no line but the compiler's. `physics` holds the parameters of the healthy
rig and what days bring, `pneumatics` and `mechanics` its compiled equations, `timing` and `sensing` what happens to
set-points and readings on their way, `disturbance` everything that can be wrong, `other_laws` every effect as a third
law, `plant` puts the rig together.
"""
