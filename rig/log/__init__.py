"""Logs: ours (`mcap`), others' (`foreign`), and what is done with either: read into records, checked, recovered,
converted, compared, played back."""
