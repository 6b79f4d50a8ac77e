"""The 5 ms side: the loop and all that it obeys. It imports the standard library and the ground floor alone, never
waits for a reader, and ends in the safe state on every path."""
