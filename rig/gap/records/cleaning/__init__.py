"""Rows that no joint and no pressure made: samples that fell to a rail, pulses, monitors that hang. They are taken out
(NaN) before anything is computed, and reported."""
