"""Makes the helpers beside the tests, the slow judges, the random calls and the benchmarks importable."""

import os
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent
for folder in (HERE, HERE.parent, HERE.parent / "fuzz", HERE.parent.parent / "benchmarks"):
    if str(folder) not in sys.path:
        sys.path.insert(0, str(folder))

from sampling import pytest_collection_modifyitems, pytest_configure, pytest_report_header  # noqa: E402, F401


@pytest.fixture
def package_for_children(monkeypatch):
    """Processes that a test starts find the same package, in whatever folder they run."""
    import flipfree

    package = Path(flipfree.__file__).resolve().parent.parent
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(package), str(HERE), *sys.path]))


@pytest.fixture
def here(tmp_path, monkeypatch, package_for_children):
    """The test runs in an empty folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path
