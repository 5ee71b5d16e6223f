"""Pictures of records: pure functions, they never simulate."""
