"""Every error in one to three lines: the key, the rule, the value, the way out."""

from __future__ import annotations
def explain(error, arguments):
    import traceback; traceback.print_exception(error); return repr(error)
