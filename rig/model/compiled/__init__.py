"""The equations as machine code: the same functions as in `equations` and `effect_stages`, over whole columns and many
records."""
