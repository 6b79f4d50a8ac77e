"""What lies on the disk, as the page shows it: records, sweeps, diagnoses, hunts, the steps of a bring-up."""
