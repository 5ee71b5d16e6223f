"""Sweeps: many runs from one command, that survive whatever happens to one of them."""
