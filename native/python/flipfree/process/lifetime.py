"""Children that end with their parent, however that ends."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
from pathlib import Path

_PR_SET_PDEATHSIG = 1


def die_with(parent: int, by: int | None = None) -> bool:
    """A parent that is killed takes its children along, where the system can do that; elsewhere they have to notice.

    by: the signal that they get then; None is one that nobody can ignore. False: it had died before, so no signal will come.
    """
    if sys.platform.startswith("linux"):
        ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_PDEATHSIG, by or signal.SIGKILL)
        return os.getppid() == parent or _is_ancestor(parent)
    return True


def _is_ancestor(pid: int) -> bool:
    """A launcher may stand between a child and its parent."""
    at = os.getpid()
    while at > 1:
        try:
            at = int(Path(f"/proc/{at}/stat").read_text().rpartition(")")[2].split()[1])
        except (OSError, ValueError, IndexError):
            return True
        if at == pid:
            return True
    return False
