"""The eighth family: rolling diaphragms in conical bores on a Scotch yoke, boosters whose domes are pulsed.

The angle is read from a potentiometer of conductive plastic. No law is shared with the other families, and no line but
what every family's rig does alike. Written from physics and the literature alone, as the judge, which it was until
there was `pouch`, by somebody who had read nothing of the diagnosis. `physics` holds the parameters of the healthy rig
and what days bring, `cylinder` a diaphragm's geometry, its rolling and its rubber, `regulator` pulses, dome and
booster, `pneumatics` flows and air, `bearing` and `mechanics` the joint, `timing` and `sensing` what happens to
set-points and readings on their way, `disturbance` everything that can be wrong, `other_laws` every effect as a ninth
law, `plant` puts the rig together.
"""
