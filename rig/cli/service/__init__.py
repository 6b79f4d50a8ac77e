"""The daemon and its clients: `pamrig daemon`, `watch`, the queue, installing it as a service."""
