"""Samples that somebody else took: reading files and tables, and what of them a model can use."""
