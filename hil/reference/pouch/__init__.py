"""The ninth family: rows of heat-sealed pouches of stretching film, rolls in place of a hinge, banks of coded valves.

The angle is read by a spot of light on a detector. No law is shared with the other families, and no line but what every
family's rig does alike. Written from physics and the literature alone, as the judge, by somebody who had read nothing
of the diagnosis: nothing is fitted on it, and nobody looks at its cases. `physics` holds the parameters of the healthy
rig and what days bring, `film` a pouch's geometry, its film and its creases, `bank` the inside of a regulator,
`pneumatics` flows and air, `rolling` the rolls and what they carry, `mechanics` the joint, `timing` and `sensing` what
happens to set-points and readings on their way, `disturbance` everything that can be wrong, `other_laws` every effect
as a tenth law, `plant` puts the rig together.
"""
