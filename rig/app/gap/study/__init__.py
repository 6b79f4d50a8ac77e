"""What the commands of `pamrig gap study` do: numbers of `rig/gap/priors.yaml` fitted to rigs of which the truth is
known, and how much each moves an answer."""
