"""The processes around the loop: the session with recorder and watchers (`session`, `records`), the daemon that keeps
one for an operator who comes and goes (`queue`, `connections`), and what looks on (`views`, `web`)."""
