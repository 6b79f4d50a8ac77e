"""What records would tell, before they are made: what a rig can show, which session shows most, and which sweep parts
what is still possible."""
