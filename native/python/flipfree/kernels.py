"""Loads the native module with the dense kernels that all processors with AVX2 and FMA share.

OpenBLAS takes kernels by the processor's model. On one that is newer than itself it takes those of 2004, three to five times
slower, and kernels of other models add in another order, so that last bits of maps would depend on the machine. What it takes
is decided when it is loaded, by the environment variable OPENBLAS_CORETYPE; whoever has set that is left alone.
"""

from __future__ import annotations

import importlib
import os
import re
from pathlib import Path

VARIABLE = "OPENBLAS_CORETYPE"
SHARED = "Haswell"  # the oldest with AVX2 and FMA; those of Zen are the same


def has_avx2(cpuinfo: str) -> bool:
    """Whether the first processor that /proc/cpuinfo lists has AVX2 and FMA."""
    flags = re.search(r"^flags\s*:(.*)$", cpuinfo, re.MULTILINE)
    return flags is not None and {"avx2", "fma"} <= set(flags[1].split())


def load_native() -> None:
    """Imports flipfree._native. The environment is as before afterwards."""
    try:
        shared = VARIABLE not in os.environ and has_avx2(Path("/proc/cpuinfo").read_text())
    except OSError:  # not Linux, or hidden
        shared = False
    if shared:
        os.environ[VARIABLE] = SHARED
    try:
        importlib.import_module("._native", __package__)
    finally:
        if shared:
            del os.environ[VARIABLE]
