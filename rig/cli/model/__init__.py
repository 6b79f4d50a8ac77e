"""`pamrig identify`, `validate` and `simulate`."""
