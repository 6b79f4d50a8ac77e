"""The first family: McKibben muscles on a pulley, spool regulators with orifice flow, Maxwell-slip hysteresis, a
potentiometer.

`physics` holds the parameters of the healthy rig, `integrate` its compiled equations, `timing` and `sensing` what
happens to set-points and readings on their way, `disturbance` everything that can be wrong, `other_laws` every effect
as another law than the library's, `plant` puts the rig together.
"""
