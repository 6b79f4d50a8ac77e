"""Logs of other tools as named columns with a time: which kind a file is, how it writes numbers, which column means
what in which unit."""
