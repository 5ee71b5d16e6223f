"""fieldrl: estimate a drifting field from the few samples that a learning vehicle chooses to take."""

__version__ = "0.1.0"
