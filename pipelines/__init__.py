"""What is measured and drawn with fieldrl, in folders of one purpose each; ``python -m pipelines`` lists it.

What several folders use lies beside them: runs found by their key or computed (``experiments``), numbers of a
run (``measures``), tables and JSON (``report``), pictures with their notes (``artefacts``).
"""

from __future__ import annotations

import sys
from importlib.machinery import ModuleSpec
from pathlib import Path

RENAMED = {"benchmark": "benchmarks.fit_speed", "fault_bench": "faults.bench", "fault_cases": "faults.cases"}
"""Old names that no file of a folder has any more, with the new ones."""


class OldNames:
    """The last to be asked for a module: an old name says its new one."""

    @staticmethod
    def find_spec(name: str, path: object = None, target: object = None) -> ModuleSpec | None:
        """Nothing is found; raises ModuleNotFoundError for ``pipelines.NAME`` that has moved to a folder."""
        package, _, old = name.rpartition(".")
        new = moved(old) if package == __name__ else None
        if new:
            raise ModuleNotFoundError(f"{name} is now {__name__}.{new}", name=name)
        return None


def moved(name: str) -> str | None:
    """Where a file now lies that once lay in this folder, as "folder.name"."""
    found = sorted(Path(__file__).parent.glob(f"*/{name}.py"))
    return RENAMED.get(name) or (f"{found[0].parent.name}.{name}" if found else None)


sys.meta_path.append(OldNames)
