"""The search for a model's parameters: where (`space`), how good a point is (`objective`), by which optimiser, and how
well the records determine what was found."""
