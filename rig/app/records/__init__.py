"""What the commands on logs do between their arguments and `rig.log`."""
