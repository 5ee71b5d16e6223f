"""The contest of agents: ``python -m pipelines.contest``."""
