"""Fits what stands in `priors.yaml` to rigs of which the truth is known; a diagnosis reads that file alone."""
