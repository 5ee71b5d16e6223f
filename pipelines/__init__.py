"""Benchmarks, and the paper's figures and tables: each runs as ``python -m pipelines.NAME``."""
