"""Every algorithm has its doors, and the page that lists them is the one the code makes."""

import runpy
from pathlib import Path

import pytest

SCRIPT = Path(__file__).resolve().parents[2] / "scripts" / "doors.py"


def test_all_doors_are_open_and_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert runpy.run_path(str(SCRIPT))["main"]([]) == 0, capsys.readouterr().out


def test_a_missing_door_is_found() -> None:
    found = runpy.run_path(str(SCRIPT))
    door = found["_door"]("nothing | 1 | embedding/embed_surface no_such | none | none | none none")
    found["missing"].__globals__["DOORS"] = (*found["DOORS"][1:], door)
    told = "\n".join(found["missing"]())
    for word in ("no no_such()", "no none", "no operator", "embed of the package has no row"):
        assert word in told, told
