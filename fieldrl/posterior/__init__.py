"""Draws from the posterior of the unknowns: an option, for what intervals and regions do not say."""
