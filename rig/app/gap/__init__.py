"""What the commands of `pamrig gap` do between their options and `rig.gap`: which records, which days, which files come
of it."""
