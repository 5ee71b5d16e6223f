"""fieldrl's launchers and sweepers, where Hydra looks for them. Nothing heavy is imported here."""
