"""An SMC ITV regulator with RS-232C, on a pseudo-terminal, at the pace of its baud rate."""
