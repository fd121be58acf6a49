"""Makes the helpers beside the tests, the slow judges, the random calls and the mesh reader of the benchmarks importable."""

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
for folder in (HERE, HERE.parent, HERE.parent / "fuzz", HERE.parent.parent / "benchmarks"):
    if str(folder) not in sys.path:
        sys.path.insert(0, str(folder))
