"""The command ``fieldrl`` and its terminal, and what Hydra does for it. The only room that knows Hydra."""
