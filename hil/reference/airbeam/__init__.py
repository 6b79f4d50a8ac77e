"""The seventh family: fabric air beams folded over a hinge, servo spools under a cascade, lines in which waves run.

The angle is read by a resolver behind a converter that tracks it. No law is shared with the other families, and no line
but what every family's rig does alike. Written from physics and the literature alone, as the judge, which it was until
there was `diaphragm`. `physics` holds the parameters of the healthy rig and what days bring, `beams` geometry, fabric
and creases of a beam, `regulator` the inside of a regulator, `line` the waves, `pneumatics` flows and air, `mechanics`
the joint, `timing` and `sensing` what happens to set-points and readings on their way, `disturbance` everything that
can be wrong, `other_laws` every effect as an eighth law, `plant` puts the rig together.
"""
