"""The fourth family: chains of flat pouches on eccentric cams, two-stage regulators with pulsed pilots.

The angle is read from a potentiometer. No law is shared with the other families, and no line but what every family's
rig does alike. Written from physics and the literature alone, by somebody who had read nothing of the diagnosis.
`physics` holds the parameters of the healthy rig and what days bring, `pneumatics` and `mechanics` its compiled
equations, `timing` and `sensing` what happens to set-points and readings on their way, `disturbance` everything that
can be wrong, `other_laws` every effect as a fifth law, `plant` puts the rig together.
"""
