"""A process for I/O that is slower than a tick: it drives one wire as fast as it goes and shares a mailbox with the
device in the loop, and with whoever has to make it safe."""
