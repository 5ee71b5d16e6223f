"""The command ``fieldrl``. Nothing heavy is imported before it is known to be needed."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit status.

    0: done; 1: an error, told in one to three lines; 130: interrupted.
    """
    arguments = list(sys.argv[1:] if argv is None else argv)
    if {"--help", "-h"} & set(arguments):
        from fieldrl.app.help import text

        print(text())
        return 0
    if "--version" in arguments:
        from fieldrl import __version__

        print(f"fieldrl {__version__}")
        return 0
    return _guarded(arguments)


def _guarded(arguments: list[str]) -> int:
    """Compose and run; every error ends here."""
    full_error = os.environ.get("HYDRA_FULL_ERROR") == "1"
    try:
        from fieldrl.app import console, notes
        from fieldrl.app.launch import launch

        with notes.told(console.note):
            launch(arguments, full_error)
    except KeyboardInterrupt:
        print("\ninterrupted; finished runs are kept, the same command continues this one", file=sys.stderr)
        return 130
    except Exception as error:
        if full_error:
            raise
        from fieldrl.app.errors import explain

        print(explain(error), file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
