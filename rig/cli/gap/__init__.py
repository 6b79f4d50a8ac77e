"""The commands of `pamrig gap`."""
