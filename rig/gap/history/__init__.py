"""A rig over many days, by their diagnoses: when its gap changed, and what grows."""
