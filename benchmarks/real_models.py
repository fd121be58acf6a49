"""Meshes that no one here made, and broken ones made at random: is every face mapped, what does a slow judge say, how long does it take?

    real_models.py fetch                          Debian's packages, unpacked below build/corpora (some 2 GB of downloads)
    real_models.py files [--share 1] [--jobs 2]   every file of these packages is one mesh, unwrapped on one thread
    real_models.py seams --above 2                the files whose energy was above in the last run, with automatic seams
    real_models.py generated [--meshes 10000] [--seed 0]      tests/python/broken_meshes.py

One file in ten, of up to 4000 faces, is judged by `judges.any_triangles`, which shares no code with ours, on the 64-bit and on the
32-bit values; all of the generated ones are. Exit status 1 at a refusal other than of coordinates that are not finite, indices out of
range and no faces, and at a crash, a face that is not mapped, a flip, a point covered twice, an energy above the bound of the seams.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import statistics
import subprocess
import sys
import time
import zipfile
import zlib
from collections import defaultdict
from collections.abc import Iterator
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

import numpy as np
from broken_meshes import broken_mesh
from model_files import SUFFIXES, Unreadable, read_model
from runner import Options, Row, main, table, timed

import flipfree as ff

from judges.any_triangles import judge_any
from mesh_files import ROOT

CORPORA = ROOT / "build" / "corpora"
OUTCOMES = CORPORA / "outcomes.jsonl"
STRETCH = 1.25

#: Package -> what is taken out of it, and out of archives inside it.
PACKAGES = {
    "assimp-testmodels": (["*"], []),
    "flightgear-data-ai": (["*.ac"], []),
    "flightgear-data-models": (["*.ac"], []),
    "libcgal-demo": (["*.tar.gz"], [".off", ".ply", ".stl", ".obj"]),
    "kicad-packages3d": (["*.wrl"], []),
    "0ad-data": (["*/public.zip"], [".pmd"]),
}
#: Faces up to which a slow judge is asked; it compares pairs of triangles.
JUDGED_FACES = 4000


def fetch() -> None:
    packages, files = CORPORA / "packages", CORPORA / "files"
    packages.mkdir(parents=True, exist_ok=True)
    for name, (patterns, inner) in PACKAGES.items():
        target = files / name
        if target.exists():
            continue
        subprocess.run(["apt-get", "download", name], cwd=packages, check=True)
        (package,) = packages.glob(f"{name}_*.deb")
        target.mkdir(parents=True)
        with subprocess.Popen(
            ["dpkg-deb", "--fsys-tarfile", package], stdout=subprocess.PIPE
        ) as tar:
            subprocess.run(
                ["tar", "-x", "-C", target, "--wildcards", *patterns], stdin=tar.stdout, check=True
            )
        for archive in [p for p in target.rglob("*") if p.suffix in (".zip", ".gz")]:
            if archive.suffix == ".gz":
                patterns = [f"*{suffix}" for suffix in inner]
                subprocess.run(
                    ["tar", "-xzf", archive, "-C", target, "--wildcards", *patterns], check=False
                )
            elif inner:
                with zipfile.ZipFile(archive) as z:
                    wanted = [n for n in z.namelist() if Path(n).suffix.lower() in inner]
                    z.extractall(target, wanted)
            if inner:
                archive.unlink()


def mapped(vertices: Any, faces: Any, judged: bool, limit: float, seams: str) -> dict[str, Any]:
    """What became of a mesh."""
    with timed() as cost:
        try:
            how = {"max_seconds": limit, "threads": 1, "seams": seams}
            result, error = ff.unwrap(vertices, faces, stretch=STRETCH, **how), ""
        except ff.FlipfreeError as given:
            result, error = None, f"{type(given).__name__}: {given}"
    record: dict[str, Any] = {"faces": len(faces), "seconds": cost.cpu}
    if result is None:
        return record | {"error": error}
    c = result.certificate
    record |= {"energy": c.energy, "charts": result.stats["charts"]}
    record["mends"] = [mend.what for mend in c.mends]
    solid = sum(len(set(face)) == 3 for face in faces.tolist())
    wrong = [] if c.triangles == solid else ["not every face is mapped"]
    wrong += [] if c.ok and c.flips64 == c.flips32 == 0 else ["not certified"]
    if seams == "auto" and c.energy > 0.5 * (STRETCH + 1.0 / STRETCH) + 1e-5:
        wrong.append(f"energy {c.energy}")
    if judged:
        record["judged"] = True
        wrong += judge_any(faces, result.uv32()) + judge_any(faces, result.uv)
        wrong += ff.certify(vertices, faces, result.uv).failures
    return record | ({"wrong": wrong} if wrong else {})


def outcome(path: str, judged: bool, limit: float, seams: str) -> dict[str, Any]:
    try:
        vertices, faces = read_model(Path(path))
    except Unreadable as error:
        return {"path": path, "unreadable": str(error)}
    judged = judged and len(faces) <= JUDGED_FACES
    return {"path": path} | mapped(vertices, faces, judged, limit, seams)


def work(pipe: Connection, limit: float, seams: str) -> None:
    while task := pipe.recv():
        pipe.send(outcome(*task, limit, seams))


class Worker:
    """A process that may crash or hang: then the next task gets a new one."""

    def __init__(self, limit: float, seams: str) -> None:
        self.how = limit, seams
        self.begin()

    def begin(self) -> None:
        self.pipe, own = multiprocessing.Pipe()
        self.process = multiprocessing.Process(target=work, args=(own, *self.how), daemon=True)
        self.process.start()
        own.close()

    def give(self, path: str, judged: bool) -> None:
        self.path, self.since = path, time.monotonic()
        self.pipe.send((path, judged))

    def answer(self, patience: float) -> dict[str, Any] | None:
        """None: not yet."""
        if self.pipe.poll():
            try:
                return self.pipe.recv()
            except EOFError:
                return self.lost("crash")
        return self.lost("hung") if time.monotonic() - self.since > patience else None

    def lost(self, why: str) -> dict[str, Any]:
        self.process.kill()
        self.process.join()
        seconds = time.monotonic() - self.since
        self.begin()
        return {"path": self.path, "error": why, "seconds": seconds}


def outcomes(paths: list[str], options: Options, seams: str) -> Iterator[dict[str, Any]]:
    tasks = iter(sorted(paths, key=lambda path: zlib.crc32(path.encode())))
    workers = [Worker(options.seconds, seams) for _ in range(options.jobs)]
    busy: list[Worker] = []
    while True:
        for worker in [w for w in workers if w not in busy]:
            path = next(tasks, None)
            if path is not None:
                worker.give(path, zlib.crc32(path.encode()) % 10 == 0)
                busy.append(worker)
        if not busy:
            return
        wait([w.pipe for w in busy], timeout=1.0)
        for worker in list(busy):
            record = worker.answer(3 * options.seconds + 60)
            if record is not None:
                busy.remove(worker)
                if "wrong" in record or ("error" in record and not refused(record)):
                    options.fail(json.dumps(record)[:500])
                yield record


MEANINGLESS = (
    "NaN or infinite",
    "not finite",
    "does not exist",
    "no faces",
    "No face",
)


def refused(record: dict[str, Any]) -> bool:
    error = record.get("error", "")
    return error.startswith("InvalidInput") and any(word in error for word in MEANINGLESS)


COLUMNS = (
    "models | number | faces | all faces mapped, certified | refused | judged again | median energy"
    " | islands: median, most | CPU s | slowest"
)


def row(name: str, group: list[dict[str, Any]]) -> Row:
    good = [r for r in group if "energy" in r and "wrong" not in r]
    energies = [r["energy"] for r in good if np.isfinite(r["energy"])]
    charts = [r["charts"] for r in good]
    seconds = [r["seconds"] for r in group]
    yield from (name, len(group), sum(r.get("faces", 0) for r in group), len(good))
    yield from (sum(map(refused, group)), sum("judged" in r for r in good))
    yield f"{statistics.median(energies):.3f}" if energies else "-"
    yield f"{statistics.median(charts):g}, {max(charts)}" if charts else "-"
    yield from (f"{sum(seconds):.0f}", f"{max(seconds):.1f}")


@table(COLUMNS)
def files(options: Options) -> Iterator[Row]:
    found = sorted(p for p in (CORPORA / "files").rglob("*") if p.suffix.lower() in SUFFIXES)
    chosen = [str(p) for p in options.cases(found[:: options.share])]
    records = []
    with OUTCOMES.open("w") as out:
        for record in outcomes(chosen, options, "given"):
            records.append(record)
            print(json.dumps(record), file=out, flush=True)
    tried = [r for r in records if "unreadable" not in r]
    kinds: dict[str, list[dict[str, Any]]] = defaultdict(list)
    for r in tried:
        for kind in r.get("mends", ["without a map"]) or ["clean"]:
            kinds[kind].append(r)
    for kind, group in sorted(kinds.items()):
        yield row(kind, group)
    if tried:
        yield row("all", tried)


@table(COLUMNS)
def seams(options: Options) -> Iterator[Row]:
    before = [json.loads(line) for line in OUTCOMES.read_text().splitlines()]
    bent = [r["path"] for r in before if r.get("energy", 0.0) > options.above]
    yield row("automatic seams", list(outcomes(list(options.cases(bent)), options, "auto")))


def made_and_mapped(seed: int) -> tuple[str, dict[str, Any]]:
    kind, (vertices, faces) = broken_mesh(seed)
    return kind, mapped(vertices, np.asarray(faces), True, 60.0, "given")


@table(COLUMNS)
def generated(options: Options) -> Iterator[Row]:
    kinds: dict[str, list[dict[str, Any]]] = defaultdict(list)
    seeds = range(options.seed, options.seed + options.meshes)
    with multiprocessing.Pool(options.jobs) as pool:
        made = pool.imap(made_and_mapped, seeds, chunksize=16)
        for seed, (kind, record) in zip(seeds, made, strict=True):
            kinds[kind].append(record)
            if "wrong" in record or "error" in record:
                options.fail(f"seed {seed} ({kind}): {record}")
    for kind in options.cases(sorted(kinds)):
        yield row(kind, kinds[kind])
    yield row("all", sum(kinds.values(), []))


def more(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--share", type=int, default=1, help="only every so manieth file")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--above", type=float, default=2.0, help="of seams: least energy before")
    parser.add_argument("--meshes", type=int, default=10_000, help="of generated")
    parser.add_argument("--seed", type=int, default=0, help="of generated")


if __name__ == "__main__":
    if sys.argv[1:] == ["fetch"]:
        sys.exit(fetch())
    sys.exit(main(__doc__, more))
