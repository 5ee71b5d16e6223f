"""Where to sample next, from an estimate that is on disk: a table and a picture in its folder."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from fieldrl.core.checks import FieldrlError
from fieldrl.measurements.sample_file import SampleFile
from fieldrl.mission.suggestion import Suggestion, suggest
from fieldrl.runs import components, configuration, netcdf
from fieldrl.runs.folder import Run

TABLE, PICTURE = "suggestion.csv", "suggestion.png"


def perform(run: Run, wanted: Mapping[str, Any]) -> Suggestion:
    """Suggest the next samples of a finished estimate, and write ``suggestion.csv`` and its picture.

    Args:
        run: the estimate's place.
        wanted: settings of ``fieldrl.mission.suggestion.suggest``; ``places`` is the path of a file.

    Raises:
        FieldrlError: there is no such estimate, or a setting is refused.
    """
    from fieldrl.figures import files
    from fieldrl.figures.suggestions import suggestion_figure

    record = netcdf.read(run.folder / "record.nc", run.key)
    if record is None or record.attrs.get("kind") != "estimate" or "information" not in record:
        problem = "holds no estimate from samples; fieldrl suggest SAMPLES experiment=NAME makes one"
        raise FieldrlError(f"{run.folder}: {problem}")
    config = _config(run.folder)
    reader = components.build(config.pop("measurements"), "measurements")
    config.pop("loss")
    configuration.check(config)
    places = reader.places(wanted["places"]) if wanted.get("places") else None
    found = suggest(record, components.model(config), **{**wanted, "places": places})
    run.write(TABLE, _table(found, reader, (run.summary() or {}).get("samples", {})))
    note = files.provenance(PICTURE, record)
    run.write(f"figures/{PICTURE}", files.png(suggestion_figure(found)))
    run.write(f"figures/{Path(PICTURE).stem}.json", json.dumps(note, indent=2) + "\n")
    return found


def _config(folder: Path) -> dict[str, Any]:
    try:
        found = yaml.safe_load((folder / ".hydra" / "config.yaml").read_text())
    except (OSError, yaml.YAMLError) as error:
        raise FieldrlError(f"{folder}: its .hydra/config.yaml cannot be read") from error
    if not isinstance(found, dict) or not {"measurements", "loss"} <= set(found):
        raise FieldrlError(f"{folder}: its .hydra/config.yaml is not that of an estimate")
    return found


def _table(found: Suggestion, reader: SampleFile, samples: Mapping[str, Any]) -> str:
    """As CSV: in the model's units and, where the file of samples has them, dates, longitudes, latitudes."""
    columns: dict[str, NDArray] = dict(found.columns)
    if samples.get("time_zero"):
        elapsed = np.round(reader.seconds_of(found.times)).astype("timedelta64[s]")
        columns["date"] = np.datetime_as_string(np.datetime64(samples["time_zero"], "s") + elapsed)
    if samples.get("degrees"):
        columns["longitude"], columns["latitude"] = reader.degrees_of(found.positions).T
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(columns)
    rows.writerows(zip(*(column.tolist() for column in columns.values()), strict=True))
    return text.getvalue()
