"""Which dense kernels the native module is loaded with."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from flipfree.kernels import SHARED, VARIABLE, has_avx2

# OpenBLAS is loaded already, by the module: the loader finds that one by its name.
SCRIPT = """
import ctypes, os, pathlib
import flipfree
beside = pathlib.Path(flipfree.__file__).parent.glob("*openblas*.dll")  # of a wheel for Windows
blas = ctypes.CDLL(str(next(beside, "libopenblas.so.0")))
blas.openblas_get_corename.restype = ctypes.c_char_p
print(blas.openblas_get_corename().decode(), os.environ.get("OPENBLAS_CORETYPE"))
"""


def kernels(**environment: str) -> list[str]:
    rest = {name: value for name, value in os.environ.items() if name != VARIABLE}
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT],
        env=rest | environment,
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout.split()


def this_has_avx2() -> bool:
    cpuinfo = Path("/proc/cpuinfo")
    return cpuinfo.exists() and has_avx2(cpuinfo.read_text())


@pytest.mark.skipif(not this_has_avx2(), reason="needs a processor with AVX2 and FMA")
def test_every_processor_with_avx2_has_the_same_kernels() -> None:
    assert kernels() == [SHARED, "None"]


def test_kernels_that_were_asked_for_are_taken() -> None:
    assert kernels(**{VARIABLE: "Nehalem"}) == ["Nehalem", "Nehalem"]
