"""One physics of the rig: a model as data (`parameters`), its stages (`equations`, `effect_stages`), stepped in plain
Python (`chain`) or compiled over whole records (`simulation`, `compiled`). `response` is the second, linearised
description that the diagnosis works with."""
