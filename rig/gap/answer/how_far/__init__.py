"""How much of the gap goes with the causes in the simulator, how much by re-tuning it, and how sure these numbers
are."""
