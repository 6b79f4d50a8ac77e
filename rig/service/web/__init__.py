"""The operator's page: a process of its own and one more client of the daemon's socket. It holds nothing that the rig
needs."""
