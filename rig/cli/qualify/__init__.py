"""`pamrig bench`, `faults` and `latency`."""
