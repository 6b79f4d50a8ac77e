"""What a command does, without its options. The only room that composes rig, drivers and stand-ins."""
