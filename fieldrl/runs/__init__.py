"""What a run is: its configuration, its key and folder, its replicates, checkpoints and record."""
