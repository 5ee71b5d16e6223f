"""The command: configuration, tracking, parallel workers, files, terminal."""
