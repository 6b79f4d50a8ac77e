"""What the commands on devices do: probe, calibrate, begin the YAML of a new rig. No loop runs here."""
