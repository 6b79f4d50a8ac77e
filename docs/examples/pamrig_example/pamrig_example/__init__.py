"""A device and an effect that pamrig finds by their entry points."""
