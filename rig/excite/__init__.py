"""What a rig is excited by: waveforms of the differential pressure, the sweep that lists them, both set-points of every
tick, and the check against the envelope before anything moves. Plain Python: the controller runs it."""
