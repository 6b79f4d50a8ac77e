"""Two SMC ITV regulators on RS-232C."""
