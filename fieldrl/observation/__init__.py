"""What the agent sees: an option of the group ``observation`` is a file here."""
