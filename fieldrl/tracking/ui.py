"""``make ui``, ``python -m fieldrl.tracking.ui [OUTPUT_DIR]``: the MLflow UI on the runs of a folder."""

from __future__ import annotations

import argparse
import os
import socket
import sqlite3
import sys
from contextlib import closing
from pathlib import Path

from fieldrl.tracking.presentation import VIEW, VIEW_TAG

_HOST = "127.0.0.1"
_PAGE = "#/experiments?workflowType=machine_learning"  # runs and charts instead of traces and prompts
_SETTINGS = {
    "MLFLOW_SERVER_ENABLE_JOB_EXECUTION": "false",  # starts in 4 s and 2 processes instead of 15 and 15
    "MLFLOW_DISABLE_TELEMETRY": "true",
}


def main() -> int:
    """Serve until interrupted; returns the exit status."""
    parser = argparse.ArgumentParser(prog="python -m fieldrl.tracking.ui", description="Open the MLflow UI.")
    parser.add_argument("output_dir", nargs="?", default="outputs", help="folder of the runs")
    parser.add_argument("--port", type=int, default=5000, help="first port that is tried")
    arguments = parser.parse_args()
    database = Path(arguments.output_dir).expanduser().resolve() / "mlflow.db"
    if not database.exists():
        print(f"{database}: no such file; `fieldrl` (or `make run`) makes it", file=sys.stderr)
        return 1
    port = free_port(arguments.port)
    print("in some seconds, until Ctrl-C:")
    for name, page in [*pages(database), ("all experiments", _PAGE)]:
        print(f"  {name:<20} http://{_HOST}:{port}/{page}", flush=True)
    os.environ.update(_SETTINGS)
    os.execv(sys.executable, command(database, port))


def pages(database: Path) -> list[tuple[str, str]]:
    """Name and address of each experiment's list of runs, in the view that was made for it."""
    query = """select e.name, e.experiment_id from experiments e join experiment_tags t using (experiment_id)
               where t.key = ? and e.lifecycle_stage = 'active' order by e.name"""
    try:
        with closing(sqlite3.connect(f"{database.as_uri()}?mode=ro", uri=True)) as connection:
            found = connection.execute(query, (VIEW_TAG,)).fetchall()
    except sqlite3.Error:
        return []
    return [(name, f"#/experiments/{number}/runs?viewStateShareKey={VIEW}") for name, number in found]


def command(database: Path, port: int) -> list[str]:
    """The command line of the server."""
    return [
        sys.executable, "-m", "mlflow", "ui", "--workers", "1", "--host", _HOST, "--port", str(port),
        "--uvicorn-opts", "--log-level warning",
        "--backend-store-uri", f"sqlite:///{database}",
        "--default-artifact-root", (database.parent / "mlartifacts").as_uri(),
    ]  # fmt: skip


def free_port(first: int) -> int:
    """The first free port from ``first`` on."""
    for port in range(first, first + 50):
        with socket.socket() as attempt:
            attempt.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            if attempt.connect_ex((_HOST, port)) != 0:
                return port
    return first


if __name__ == "__main__":
    sys.exit(main())
