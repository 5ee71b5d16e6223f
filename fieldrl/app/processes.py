"""Who a process is, so that another one can tell later whether it still lives."""

from __future__ import annotations

import os
import platform
from collections.abc import Mapping
from pathlib import Path


def identity() -> dict[str, str]:
    """Host, number and start of this process."""
    return {"host": platform.node(), "pid": str(os.getpid()), "started": _started(os.getpid())}


def alive(known: Mapping[str, str]) -> bool:
    """Whether the process of an ``identity`` may still be there; nobody knows for other hosts: true."""
    if not {"host", "pid", "started"} <= known.keys() or not known["pid"].isdigit():
        return False
    if known["host"] != platform.node():
        return True
    return _exists(int(known["pid"])) and _started(int(known["pid"])) == known["started"]


def _exists(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except OSError:  # another user's
        return True
    return True


def _started(pid: int) -> str:
    """When a process began, in the system's own measure; empty where the system does not say."""
    try:
        boot = Path("/proc/sys/kernel/random/boot_id").read_text().strip()
        return f"{boot} {Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()[19]}"
    except (OSError, IndexError):
        return ""
