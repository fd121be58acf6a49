"""python -m flipfree in a folder of the test's own (fixture `here`): what is put there, and what comes of it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import flipfree as ff
from flipfree.__main__ import main


def put(name: str, mesh: Any, **beside: Any) -> None:
    """A model, and files beside it: pins={...} is NAME.pins.json."""
    ff.write(name, mesh)
    for kind, told in beside.items():
        Path(f"{name}.{kind}.json").write_text(json.dumps(told))


def run(*words: object) -> dict[str, Any]:
    """The only record of a run."""
    assert main([*map(str, words), "--json", "results.jsonl", "--quiet"]) == 0
    (line,) = Path("results.jsonl").read_text().splitlines()
    Path("results.jsonl").unlink()
    return dict(json.loads(line))


def mapped(*words: object) -> dict[str, Any]:
    """The same of a model that got its map."""
    record = run(*words)
    assert record["status"] in ("certified", "warned"), record["message"]
    assert record["written"] and record["certificate"]["ok"]
    assert record["certificate"]["poor"] == (record["status"] == "warned")
    return record


def refusal(capsys: Any, *words: object) -> str:
    """What is said where nothing is done."""
    try:
        status = main([*map(str, words)])
    except SystemExit as ended:
        status = ended.code
    assert status == 2
    return str(capsys.readouterr().err)


def judged(path: str, **wanted: Any) -> Any:
    """The mesh of a file, certified."""
    mesh = ff.read(path)
    certificate = ff.certify(mesh.vertices, mesh.faces, mesh.uv, **wanted)
    assert certificate.ok, certificate
    return mesh
