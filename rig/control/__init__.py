"""The desk side of a closed loop: the feed-forward by a model's inverse, gains with their margins, and how well an
angle followed. What follows them in the loop is `rig.realtime.closed_loop`."""
