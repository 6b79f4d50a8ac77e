"""The modelled world: the simulated rig and physics plants as devices, faults to switch on, and emulators of hardware.
It meets the rig at `rig.interfaces` and `rig.model`."""
