"""The real world: devices by the name of their kind (`catalog`), each a codec (bytes and counts, no I/O) and a device.
They meet the rig at `rig.interfaces` and import no numpy."""
