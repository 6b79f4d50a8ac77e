"""Physics rigs that share no law with the simulator: what the model is identified on and the blind check is drawn from.

`families` is the way in: a family by name (`names`), its units, days and effects. `mckibben`, `fluidic`, `pleated`,
`bellows`, `bundle`, `sleeve`, `airbeam`, `diaphragm` and `pouch` hold one family each, `plant`, `disturbance` and
`effect_law` what all have in common, `excitations` the commands, `cases` the drawing of development and scoring cases,
`source` the cases as the blind check takes them.
Nothing here reads or writes files.
"""
