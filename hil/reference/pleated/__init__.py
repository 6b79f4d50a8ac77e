"""The third family: pleated muscles on cranks, servo valves of second order with dead time, a magnetic encoder.

No law is shared with the other
families, and no line but what every family's rig does alike. `physics` holds the parameters of the healthy rig and what
days bring, `pneumatics` and `mechanics` its compiled equations, `timing` and `sensing` what happens to set-points and
readings on their way, `disturbance` everything that can be wrong, `other_laws` every effect as a fourth law, `plant`
puts the rig together.
"""
