"""What `pamrig identify` and `pamrig simulate` do."""
