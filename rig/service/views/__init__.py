"""What is told of the rig to others than an operator: faults in the log, live view, metrics, systemd."""
