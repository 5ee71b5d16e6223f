"""Losses of a standardised residual z = residual / scale. An outlier counts less in a robust one.

A loss rho(z) >= 0 is given by its root s = sign(z) sqrt(rho(z)), so that whatever minimises a sum of squares
minimises a sum of losses. Pure functions of arrays.
"""
