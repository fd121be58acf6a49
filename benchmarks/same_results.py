"""Have results changed? Public calls on the same inputs, beside what an earlier build gave.

    same_results.py write ROWS [--of corpus] [--only TEXT]      runs calls, a JSON row per case; cases that ROWS has are skipped
    same_results.py calls CALLS --of models                     keeps calls with their inputs, which both builds can then be given:
    same_results.py write ROWS --of CALLS
    same_results.py compare BEFORE AFTER [--bits]

Calls of the corpus: those of deadlines.py, on its meshes up to --faces triangles; of models: the first --count files that
real_models.py fetched; of random: --count calls of every public function that tests/fuzz/random_options.py makes; without a limit of
time but --seconds, on one thread where calls say so. A row holds a hash of all arrays of the result, whether it is certified, its
energy, added vertices and CPU seconds, or the error's text; of a case that ended the process nothing: call it again. Calls that a build
does not know are left out. `compare` prints a table of calls and what was lost; exit status 1 if anything was, with --bits if anything
differs to the last bit.
"""

from __future__ import annotations

import argparse
import dataclasses
import hashlib
import inspect
import json
import pickle
import sys
import time
import zlib
from collections import defaultdict
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np

import flipfree as ff

#: Name of the case, public function, positional and named arguments.
Call = tuple[str, str, tuple[Any, ...], dict[str, Any]]
MODEL_CALLS = {"unwrap": {"seams": "auto"}, "seamless": {}, "field_aligned": {}}


def made(name: str, state: dict[str, Any]) -> Any:
    one = object.__new__(getattr(ff, name))
    one.__dict__.update(state)
    return one


class Keeper(pickle.Pickler):
    """Knows what the package returns by its public name: modules move."""

    def reducer_override(self, one: Any) -> Any:
        public = hasattr(ff, type(one).__name__) and hasattr(one, "__dict__")
        return (made, (type(one).__name__, vars(one))) if public else NotImplemented


# What makes calls is imported where it is needed: an earlier build, to which it is foreign, runs what was kept.
def of_corpus(given: argparse.Namespace) -> Iterator[Call]:
    from deadlines import Maps, corpus, public_calls

    from hostile_values import FUNCTIONS

    maps, meshes = Maps(), [case for case in corpus() if len(case[2]) <= given.faces]
    for case in meshes:
        maps.of(case)
    keys, taken = [], []
    names = *FUNCTIONS, "split_fans", "islands"
    takers = {n: lambda *a, _name=n, **k: taken.append((_name, a, k)) for n in names}
    with patch.multiple(ff, **takers):
        for name, (call, takes) in public_calls(maps).items():
            for case in filter(takes, meshes):
                call(case, 0.0)
                keys.append(f"{name}: {case[0]}")
    yield from ((key, *one) for key, one in zip(keys, taken, strict=True))


def of_models(given: argparse.Namespace) -> Iterator[Call]:
    from model_files import SUFFIXES, Unreadable, read_model
    from real_models import CORPORA, draw

    files = (p for p in (CORPORA / "files").rglob("*") if p.suffix.lower() in SUFFIXES)
    seen: set[tuple[int, int]] = set()
    for path in sorted(files, key=draw):
        try:
            vertices, faces = read_model(path)
        except Unreadable:
            continue
        if not 10 <= len(faces) <= 12_000 or (len(vertices), len(faces)) in seen:
            continue
        if len(seen) == given.count:
            return
        seen.add((len(vertices), len(faces)))
        for call, how in MODEL_CALLS.items():
            yield f"{call}: {path.parent.name}/{path.name}", call, (vertices, faces), how


def of_random(given: argparse.Namespace) -> Iterator[Call]:
    from hostile_values import FUNCTIONS
    from random_meshes import random_mesh
    from random_options import random_arguments

    for name in FUNCTIONS:
        for seed in range(given.count):
            random = np.random.default_rng([zlib.crc32(name.encode()), seed])
            mesh = random_mesh(random, 0.5 if name == "seamless" else 0.0)
            how = random_arguments(name, mesh, random, hostile=0.0)
            how.pop("max_seconds", None)
            yield f"{name}: {seed} {', '.join(mesh.what)}", name, (), how


SOURCES = {"corpus": of_corpus, "models": of_models, "random": of_random}


def calls_of(given: argparse.Namespace) -> Iterator[Call]:
    source = SOURCES.get(given.of)
    return source(given) if source else pickle.loads(Path(given.of).read_bytes())


def parts(value: Any) -> Iterator[Any]:
    """All arrays, numbers and texts of a result but what clocks say."""
    if dataclasses.is_dataclass(value):
        value = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        for key in value:
            if "seconds" not in str(key):
                yield from parts(value[key])
    elif isinstance(value, tuple | list):
        for one in value:
            yield from parts(one)
    elif isinstance(value, int) and not isinstance(value, bool):
        yield np.asarray(value, np.int64)  # of 32 bits on Windows otherwise
    elif isinstance(value, np.ndarray | bool | float | str):
        yield np.asarray(value)


def row(result: Any) -> dict[str, Any]:
    text = hashlib.sha256()
    for array in map(np.ascontiguousarray, parts(result)):
        text.update(f"{array.dtype}{array.shape}".encode())
        text.update(array.tobytes())
    certificate = getattr(result, "certificate", result)
    ok = getattr(certificate, "ok", getattr(result, "converged", True))
    figures = {
        "energy": getattr(certificate, "energy", None),
        "added": (getattr(result, "stats", None) or {}).get("added_vertices"),
    }
    found = {key: float(x) for key, x in figures.items() if isinstance(x, int | float)}
    return {"values": text.hexdigest()[:16], "ok": bool(ok)} | found


def read(path: Path) -> dict[str, dict[str, Any]]:
    lines = path.read_text().splitlines() if path.exists() else []
    return {one.pop("case"): one for one in map(json.loads, lines)}


def write(path: Path, given: argparse.Namespace) -> int:
    there = read(path)
    with path.open("a") as out:
        for key, name, positional, named in calls_of(given):
            if key in there or given.only not in key:
                continue
            call = getattr(ff, name, None)
            takes = inspect.signature(call).parameters if call else {}
            if call is None or not named.keys() <= takes.keys():
                continue  # an earlier build's
            limits = {"max_seconds": given.seconds, "threads": 1}
            named = named | {n: limit for n, limit in limits.items() if n in takes}
            print(json.dumps({"case": key}), file=out, flush=True)
            begin = time.process_time()
            try:
                result = row(call(*positional, **named))
            except Exception as error:
                result = {"error": type(error).__name__, "text": str(error)}
            result["seconds"] = round(time.process_time() - begin, 4)
            print(json.dumps({"case": key} | result), file=out, flush=True)
    return 0


def grown(pairs: list[tuple[dict[str, Any], dict[str, Any]]], key: str) -> str:
    """Sums; median and 95th percentile of after / before, of those that are not nothing."""
    found = np.array([(a[key], b[key]) for a, b in pairs if key in a and key in b]).reshape(-1, 2)
    both = found[(found > 0).all(1) & np.isfinite(found).all(1)]
    shares = np.percentile(both[:, 1] / both[:, 0], (50, 95)) if len(both) else (1, 1)
    return "{:.5g} -> {:.5g}; {:.3f}, {:.3f}".format(*found.sum(0), *shares)


def compare(before: Path, after: Path, bits: bool) -> int:
    old, new = read(before), read(after)
    calls: dict[str, list[str]] = defaultdict(list)
    for name in filter(new.__contains__, old):
        calls[name.split(":")[0]].append(name)
    print("| call | cases | certified | lost | other bits | energy | added vertices | CPU s |")
    print("|---" * 8 + "|")
    told = []
    for call, names in calls.items():
        pairs = [(old[name], new[name]) for name in names]
        good = [(a, b) for a, b in pairs if a.get("ok") and b.get("ok")]
        certified = " -> ".join(
            str(sum(r.get("ok", False) for r in rows)) for rows in zip(*pairs, strict=True)
        )
        lost = [n for n in names if old[n].get("ok") and not new[n].get("ok")]
        other = [n for n in names if old[n] | {"seconds": 0} != new[n] | {"seconds": 0}]
        figures = grown(good, "energy"), grown(good, "added"), grown(pairs, "seconds")
        print(
            "|",
            " | ".join(map(str, (call, len(names), certified, len(lost), len(other), *figures))),
            "|",
        )
        told += other if bits else lost
    for name in told:
        print(f"{name}: {old[name]} -> {new[name]}")
    return int(bool(told or not calls))


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("verb", choices=("write", "calls", "compare"))
    parser.add_argument("files", type=Path, nargs="+")
    parser.add_argument("--of", default="corpus", help="corpus, models, random, or a file of calls")
    parser.add_argument("--only", default="", help="cases with this text in their names")
    parser.add_argument("--faces", type=int, default=5000)
    parser.add_argument("--count", type=int, default=400)
    parser.add_argument("--seconds", type=float, default=0.0)
    parser.add_argument("--bits", action="store_true")
    given = parser.parse_args()
    if given.verb == "compare":
        return compare(*given.files, given.bits)
    if given.verb == "calls":
        with given.files[0].open("wb") as out:
            Keeper(out).dump(list(calls_of(given)))
        return 0
    return write(given.files[0], given)


if __name__ == "__main__":
    sys.exit(main())
