"""MLflow runs that were interrupted, found by their key and continued under the id that they have."""

from __future__ import annotations

import time
from collections.abc import Mapping

from mlflow.entities import Run
from mlflow.tracking import MlflowClient

from fieldrl.app import processes

_WINDING_UP = 10.0  # how long a publisher whose run was killed may take to end [s]


def runs(client: MlflowClient, experiment_id: str, key: str) -> list[Run]:
    """Unfinished runs of a key that nobody is at work on, newest first; none of them is left RUNNING.

    Args:
        client: MLflow's client.
        experiment_id: where to look.
        key: of the run. Jobs of sweeps and replicates are not meant.
    """
    condition = f"tags.key = '{key}' and attributes.status != 'FINISHED'"
    found = client.search_runs([experiment_id], condition, order_by=["attributes.start_time DESC"])
    ours = [run for run in found if not {"job", "replicate"} & run.data.tags.keys()]
    return [run for run in ours if _ended(client, experiment_id, run)]


def begun(
    client: MlflowClient, experiment_id: str, name: str, tags: Mapping[str, str], known: Run | None
) -> str:
    """The id of a RUNNING run: the ``known`` one, unless it is FINISHED, or a new one."""
    if known is None:
        return client.create_run(experiment_id, run_name=name, tags=dict(tags)).info.run_id
    run_id = known.info.run_id
    if known.info.status != "FINISHED":
        client.update_run(run_id, "RUNNING")
        for tag, value in tags.items():
            client.set_tag(run_id, tag, value)
    return run_id


def children(client: MlflowClient, experiment_id: str, parent: str) -> dict[str, Run]:
    """The replicates of a run, by their number."""
    found = client.search_runs([experiment_id], f"tags.`mlflow.parentRunId` = '{parent}'")
    return {run.data.tags["replicate"]: run for run in found if "replicate" in run.data.tags}


def _ended(client: MlflowClient, experiment_id: str, run: Run) -> bool:
    """End a run whose process is gone, with its replicates; false where somebody is at work on it."""
    end, identity = time.monotonic() + _WINDING_UP, processes.identity().items()
    while run.info.status == "RUNNING" and not run.data.tags.items() >= identity:
        if not processes.alive(run.data.tags):
            for one in (run, *children(client, experiment_id, run.info.run_id).values()):
                if one.info.status == "RUNNING":
                    client.set_tag(one.info.run_id, "status", "killed")
                    client.set_terminated(one.info.run_id, "KILLED")
            return True
        if time.monotonic() > end:
            return False
        time.sleep(0.2)
        run = client.get_run(run.info.run_id)
    return True
