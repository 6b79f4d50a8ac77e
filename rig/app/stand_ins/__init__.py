"""Rigs in place of hardware: real drivers on emulators, a recording, a simulator that answers whole records."""
