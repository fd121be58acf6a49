"""Loads the native module with the dense kernels that all processors with AVX2 and FMA share.

OpenBLAS takes kernels by the processor's model. On one that is newer than itself it takes those of 2004, three to five times
slower, and kernels of other models add in another order, so that last bits of maps would depend on the machine. What it takes
is decided when it is loaded, by the environment variable OPENBLAS_CORETYPE; whoever has set that is left alone.
"""

from __future__ import annotations

import importlib
import os
import re
import sys
from pathlib import Path

VARIABLE = "OPENBLAS_CORETYPE"
SHARED = "Haswell"  # the oldest with AVX2 and FMA; those of Zen are the same


def has_avx2(cpuinfo: str) -> bool:
    """Whether the first processor that /proc/cpuinfo lists has AVX2 and FMA."""
    flags = re.search(r"^flags\s*:(.*)$", cpuinfo, re.MULTILINE)
    return flags is not None and {"avx2", "fma"} <= set(flags[1].split())


def _this_has_avx2() -> bool:
    if sys.platform == "win32":
        from .process import windows

        return windows.has_avx2()
    try:
        return has_avx2(Path("/proc/cpuinfo").read_text())
    except OSError:  # macOS, whose processors have other kernels, or hidden
        return False


def load_native() -> None:
    """Imports flipfree._native. The environment is as before afterwards."""
    shared = VARIABLE not in os.environ and _this_has_avx2()
    if shared:
        os.environ[VARIABLE] = SHARED
    try:
        importlib.import_module("._native", __package__)
    finally:
        if shared:
            del os.environ[VARIABLE]
