"""Which jobs a sweep has, how they are done, and what is kept of them: every combination, or a search."""
