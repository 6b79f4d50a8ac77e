"""The blind check: the diagnosis on records whose cause is withheld from it.

`source` says what a generator must offer, `seal` closes the labels, `folder` lays out a check on disk, `generate`
writes questions, `sandbox` and `answer` run the diagnosis where it cannot see the labels, `naive` are the baselines to
beat, `score` opens the labels and makes each case a `row`, `statistics` counts rows, `check` is the whole. No generator
is known here: the command line brings one.
"""
