"""A physics rig that shares no law with the simulator: what the model is identified on and the blind check is drawn from.

`physics` holds the parameters of the healthy rig, `integrate` its compiled equations, `command` and `sensing` what happens
to set-points and readings on their way, `other_laws` every effect as another law than the library's, `plant` the rig as a function
of excitation, session and effect, and `cases` the drawing of development and scoring cases. Nothing here reads or writes files.
"""
