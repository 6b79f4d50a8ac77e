"""The parts of `pamrig bench devices`: each device on its emulator."""
