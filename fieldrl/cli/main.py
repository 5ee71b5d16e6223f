"""The command ``fieldrl``. Nothing heavy is imported before it is known to be needed.

Its first word may be a verb; without one, a run or a sweep is what is wanted.
"""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Callable, Sequence

VERBS: dict[str, str] = {
    "list": "fieldrl.cli.list_show_clean:list_runs",
    "show": "fieldrl.cli.list_show_clean:show",
    "report": "fieldrl.cli.report:main",
    "clean": "fieldrl.cli.list_show_clean:clean",
    "estimate": "fieldrl.cli.estimate:main",
    "suggest": "fieldrl.cli.suggest:main",
}
"""The module and function behind each verb: it is given what follows the verb, and raises its errors."""

_BRIEF = ("list", "show", "report", "clean")  # the others have a help of their own


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit status.

    0: done; 1: an error, told in one to three lines; 130: interrupted.
    """
    arguments = list(sys.argv[1:] if argv is None else argv)
    if arguments and arguments[0] in _BRIEF and {"--help", "-h"} & set(arguments):
        from fieldrl.cli.help import of_verb

        print(of_verb(arguments[0]))
        return 0
    if arguments and arguments[0] in VERBS:
        return _guarded(lambda: _verb(arguments[0])(arguments[1:]))
    if {"--help", "-h"} & set(arguments):
        from fieldrl.cli.help import text

        print(text())
        return 0
    if "--version" in arguments:
        from fieldrl import __version__

        print(f"fieldrl {__version__}")
        return 0
    return _guarded(lambda: _launch(arguments))


def _verb(name: str) -> Callable[[Sequence[str]], object]:
    """The function behind a verb."""
    module, _, function = VERBS[name].partition(":")
    return getattr(importlib.import_module(module), function)


def _launch(arguments: list[str]) -> None:
    """Compose and run."""
    from fieldrl.cli import terminal
    from fieldrl.cli.launch import launch
    from fieldrl.runs import warning_lines

    with warning_lines.told(terminal.note):
        launch(arguments, _full_error())


def _full_error() -> bool:
    return os.environ.get("HYDRA_FULL_ERROR") == "1"


def _guarded(action: Callable[[], object]) -> int:
    """Do it; every error ends here."""
    try:
        action()
    except KeyboardInterrupt:
        print("\ninterrupted; finished runs are kept, the same command continues this one", file=sys.stderr)
        return 130
    except Exception as error:
        if _full_error():
            raise
        from fieldrl.runs.explain import explain

        print(explain(error), file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
