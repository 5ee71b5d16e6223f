"""How good and how fast is the solver? Work and precision, py-pde, and what the grid does to an estimate.

    python -m pipelines.benchmarks.solver            everything
    python -m pipelines.benchmarks.solver --quick    without the largest grids

All on the paper's second experiment (double gyre, T = 10, rho = 1, sigma = 20). Errors are root mean squares
over 200 x 100 points at T, in field units, against a fine solution whose own error is shown. Costs are CPU
seconds of one process, the least of several runs, measured side by side; nothing is taken from a store.
Writes outputs/solver.json. Needs the extra ``benchmark`` for py-pde, and leaves it out where it is missing.

Takes eight minutes.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fieldrl.core.streams import stream
from fieldrl.pde.advection_diffusion import AdvectionDiffusion
from fieldrl.pde.solutions import Solutions
from fieldrl.vehicle.unicycle import Unicycle

GRIDS = ((64, 32), (80, 40), (100, 50), (126, 63), (142, 71), (200, 100), (284, 142))
ORACLE_GRIDS = ((200, 100), (400, 200), (800, 400))
BASELINE = (3, (200, 100))  # third-order upwind with the same time steps
COLD = """
import time; began = time.process_time()
from fieldrl.pde.advection_diffusion import AdvectionDiffusion
model = AdvectionDiffusion(cells=({0}, {1}), order={2})
theta, loaded = model.parameters.true, time.process_time()
model.solve(theta); print(loaded - began, time.process_time() - loaded)
"""


def model_on(cells: tuple[int, int], order: int = 9) -> AdvectionDiffusion:
    """The experiment's model on a grid, without memory."""
    return AdvectionDiffusion(cells=cells, order=order, solutions=Solutions(memory=0.0))


def field_of(model: AdvectionDiffusion) -> NDArray[np.float64]:
    """The field at T on the common points."""
    return model.field(np.array(model.parameters.true), model.final_time, model.domain.grid(200, 100))


def rms(values: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def costs(models: Sequence[AdvectionDiffusion], repeats: int) -> list[float]:
    """CPU seconds of one solve of each, the least of several, taken in turns."""
    least = [np.inf] * len(models)
    for _ in range(repeats):
        for place, model in enumerate(models):
            began = time.process_time()
            model.solve(model.parameters.true)
            least[place] = min(least[place], time.process_time() - began)
    return least


def reference(quick: bool) -> tuple[AdvectionDiffusion, dict[str, Any]]:
    """A model on a fine grid, and how much it differs from the next coarser one."""
    fine, coarse = ((480, 240), (360, 180)) if quick else ((640, 320), (480, 240))
    model = replace(model_on(fine), solutions=Solutions())
    difference = rms(field_of(model) - field_of(model_on(coarse)))
    return model, {"cells": fine, "next": coarse, "difference": difference}


def work_precision(exact: NDArray[np.float64], repeats: int) -> list[dict[str, Any]]:
    """Error and cost of all orders on all grids."""
    kinds = [(order, cells) for order in (3, 5, 7, 9) for cells in GRIDS]
    models = [model_on(cells, order) for order, cells in kinds]
    errors = [rms(field_of(model) - exact) for model in models]
    rows = []
    for (order, cells), error, seconds in zip(kinds, errors, costs(models, repeats), strict=True):
        rows.append({"order": order, "cells": cells, "rms": error, "seconds": seconds})
        place = f"{cells[0]:4d} x {cells[1]:3d}"
        print(f"  order {order}  {place}  rms {error:8.4f}  {seconds:8.4f} s")
    return rows


def against_baseline(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """The default grid, and the cheapest below 0.05, against third-order upwind on 200 x 100."""
    base = next(row for row in rows if (row["order"], row["cells"]) == BASELINE)
    good = min((row for row in rows if row["rms"] < 0.05), key=lambda row: row["seconds"])
    return {"baseline": base, "best": good, "cost_ratio": good["seconds"] / base["seconds"]}


def against_oracle(
    exact: AdvectionDiffusion, rows: list[dict[str, Any]], quick: bool
) -> list[dict[str, Any]]:
    """py-pde, and our cheapest solve that is at least as good; compilation excluded, then included."""
    from pipelines.benchmarks import oracle

    table, theta = [], np.array(exact.parameters.true)
    for cells in ORACLE_GRIDS[: 2 if quick else 3]:
        times, field = {}, np.empty(0)
        for name, equation in (("expression", oracle.written), ("by hand", oracle.GyreEquation)):
            repeats = 15 if cells[0] < 400 else 2
            field, *times[name] = oracle.solve(exact, theta, cells, repeats, equation=equation)
        error = rms(field - exact.field(theta, exact.final_time, exact.domain.grid(*cells)))
        ours = min((row for row in rows if row["rms"] <= error), key=lambda row: row["seconds"])
        load, first = fresh_process(ours["order"], ours["cells"])
        row = {"cells": cells, "rms": error, "py_pde": times, "ours": ours}
        table.append({**row, "ours_first_solve": first, "ours_import": load})
        _tell_oracle(table[-1])
    return table


def _tell_oracle(row: dict[str, Any]) -> None:
    ours, first = row["ours"], row["ours_first_solve"]
    print(f"  {row['cells'][0]} x {row['cells'][1]}: rms {row['rms']:.4f}")
    for name, (alone, compiled) in row["py_pde"].items():
        print(f"    py-pde, {name:10}  {alone:8.4f} s, with compilation {compiled:5.1f} s:", end=" ")
        print(f"ours is {alone / ours['seconds']:.0f} and {compiled / first:.0f} times as fast")
    print(f"    ours, order {ours['order']} on {ours['cells'][0]} x {ours['cells'][1]}:", end=" ")
    print(f"rms {ours['rms']:.4f}, {ours['seconds']:.4f} s, first solve of a process {first:.3f} s")


def fresh_process(order: int, cells: tuple[int, int]) -> tuple[float, float]:
    """CPU seconds of import and of the first solve in a new process, numba's cache on disk being warm."""
    code = COLD.format(*cells, order)
    out = [
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        for _ in range(2)
    ]
    load, first = (float(word) for word in out[-1].stdout.split())
    return load, first


def random_path(model: Any, theta: NDArray, number: int) -> tuple[NDArray, NDArray]:
    """Ten samples of a random walk: positions (10, 2), times (10,)."""
    rng, vehicle = stream(number, "grid error"), Unicycle(start=(60.0, 40.0))
    state, places = vehicle.initial(), []
    for step in range(10):
        action = int(rng.integers(len(vehicle.actions)))
        state = vehicle.step(state, action, float(step), model.flow, theta, model.domain)
        places.append(state[:2])
    return np.array(places), np.arange(1.0, 11.0)


def shift(
    model: AdvectionDiffusion, theta: NDArray, positions: NDArray, times: NDArray
) -> NDArray[np.float64]:
    """How far refining the grid once moves an estimate, in its standard deviations at sigma = 1, (2,).

    To first order the least-squares estimate moves by (J'J)^-1 J' (change of the predictions), and its
    standard deviations are the roots of the diagonal of (J'J)^-1. NaN where the samples do not determine it.
    """
    finer, steps = replace(model, cells=tuple(2 * n for n in model.cells)), np.array([1e-3, 2e-3])
    moves = (theta + sign * np.diag(steps)[k] for k in (0, 1) for sign in (1, -1))
    here, *around = model.predict(np.array([theta, *moves]), positions, times)
    jacobian = (np.array(around[::2]) - np.array(around[1::2])).T / (2 * steps)
    information = jacobian.T @ jacobian
    if np.linalg.cond(information) > 1e12:
        return np.full(2, np.nan)
    covariance = np.linalg.inv(information)
    change = covariance @ jacobian.T @ (finer.predict(theta[None], positions, times)[0] - here)
    return np.abs(change) / np.sqrt(np.diag(covariance))


def grid_error(cells: Sequence[int], quick: bool) -> dict[str, Any]:
    """Shifts at the true parameters and two other places."""
    model, moved = AdvectionDiffusion(cells=cells), []
    for theta in ((0.25, np.pi / 5), (0.1, 1.0), (0.4, 0.4))[: 1 if quick else 3]:
        for number in range(100):
            moved.append(shift(model, np.array(theta), *random_path(model, np.array(theta), number)))
    table = np.array([row for row in moved if np.isfinite(row).all()])
    return {
        "cells": cells,
        "paths": len(table),
        "median": np.median(table, axis=0).tolist(),
        "ninetieth": np.quantile(table, 0.9, axis=0).tolist(),
        "largest": table.max(axis=0).tolist(),
        "below_a_fifth": float(np.mean(table.max(axis=1) < 0.2)),
    }


def grid_errors(quick: bool) -> list[dict[str, Any]]:
    """The table of grid errors."""
    print("How far refining the grid once moves an estimate, in its standard deviations (mu, omega)")
    rows = [grid_error(cells, quick) for cells in ((100, 50), AdvectionDiffusion().cells, (200, 100))]
    for row in rows:
        print(f"  {row['cells'][0]} x {row['cells'][1]}, {row['paths']} paths:", end=" ")
        print(
            "  ".join(
                f"{key} {np.round(row[key], 3)}"
                for key in ("median", "ninetieth", "largest", "below_a_fifth")
            )
        )
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("--quick", action="store_true", help="leave out the largest grids")
    parser.add_argument("--output", type=Path, default=Path("outputs/solver.json"))
    options = parser.parse_args()
    exact, about = reference(options.quick)
    print("Reference {cells}: differs from {next} by {difference:.2e}".format(**about))
    print("Work and precision")
    rows = work_precision(field_of(exact), 3 if options.quick else 15)
    result: dict[str, Any] = {"reference": about, "work_precision": rows, "upwind": against_baseline(rows)}
    print(
        "Against third-order upwind on 200 x 100: rms {rms:.4f}".format(**result["upwind"]["best"]), end=" "
    )
    print(f"for {result['upwind']['cost_ratio']:.2f} of its cost")
    if importlib.util.find_spec("pde"):
        print("Against py-pde, at no larger an error")
        result["py_pde"] = against_oracle(exact, rows, options.quick)
    result["grid_error"] = grid_errors(options.quick)
    options.output.parent.mkdir(parents=True, exist_ok=True)
    options.output.write_text(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
