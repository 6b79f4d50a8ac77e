"""Stand-ins for the wire: the real drivers talk the real protocols to them. One plant (`world`) behind all of a rig's
wires."""
