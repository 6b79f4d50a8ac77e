"""Fits that need no swarm: the regulators, the response model of a rig, and the fingerprint that a model's file keeps
of it."""
