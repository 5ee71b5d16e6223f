"""MLflow as a view of runs and sweeps, written by a process of its own. The only room that knows MLflow."""
