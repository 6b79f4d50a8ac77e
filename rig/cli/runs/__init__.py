"""The commands that move a rig: `pamrig run`, `replay`, `track` and `tune`, and the table that they end with."""
