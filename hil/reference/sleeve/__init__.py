"""The sixth family: rubber sleeves with straight fibres and rings on spiral sectors, nozzle and flapper before a spool.

The angle is read by a Hall element over a magnet. No law is shared with the other families, and no line but what every
family's rig does alike. Written from physics and the literature alone, by somebody who had read nothing of the
diagnosis. `physics` holds the parameters of the healthy rig and what days bring, `sleeves` geometry and rubber of a
muscle, `regulator` a regulator's inside, `pneumatics` flows and chambers, `mechanics` the joint, `timing` and `sensing`
what happens to set-points and readings on their way, `disturbance` everything that can be wrong, `other_laws` every
effect as a seventh law, `plant` puts the rig together.
"""
