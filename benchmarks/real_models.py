"""Meshes that no one here made, by the thousand: is every face mapped, how long does it take, what does a slow judge say?

    export PYTHONPATH=build/python:tests:tests/python:benchmarks
    real_models.py fetch                      # Debian's packages, unpacked below build/corpora (some 2 GB of downloads)
    real_models.py run [--folder F] [--share 1] [--only TEXT] [--jobs 2] [--limit 30]
    real_models.py run --above 2 [--stretch 1.25]      # the files whose energy was above, with automatic seams
    real_models.py table                      # from the last run's build/corpora/outcomes.jsonl

Every file is one mesh, unwrapped with its own process' limit; one in `--judged` is judged by `judges.any_triangles`. Exit
status 1 at a refusal other than of coordinates that are not finite, indices out of range and no faces, and at a crash, a face
that is not mapped, a flip, a point covered twice.
"""

from __future__ import annotations

import argparse
import collections
import json
import multiprocessing
import statistics
import subprocess
import time
import zipfile
import zlib
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

import numpy as np
from model_files import SUFFIXES, Unreadable, read_model

import flipfree as ff

from judges.any_triangles import judge_any
from mesh_files import ROOT

CORPORA = ROOT / "build" / "corpora"
OUTCOMES = CORPORA / "outcomes.jsonl"

#: Package -> what is taken out of it, and out of archives inside it.
PACKAGES = {
    "assimp-testmodels": (["*"], []),
    "flightgear-data-ai": (["*.ac"], []),
    "flightgear-data-models": (["*.ac"], []),
    "libcgal-demo": (["*.tar.gz"], [".off", ".ply", ".stl", ".obj"]),
    "openarena-081-players": (["*.pk3"], [".md3"]),
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
        for archive in [p for p in target.rglob("*") if p.suffix in (".zip", ".pk3", ".gz")]:
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


def outcome(path: str, limit: float, judged: bool, options: dict[str, Any]) -> dict[str, Any]:
    """What became of one file, as a line of JSON. Options: those of the unwrap."""
    try:
        vertices, faces = read_model(Path(path))
    except Unreadable as error:
        return {"path": path, "unreadable": str(error)}
    record: dict[str, Any] = {"path": path, "faces": len(faces)}
    begin = time.process_time()  # one thread: what a clock shows on an idle machine
    try:
        result = ff.unwrap(vertices, faces, max_seconds=limit, threads=1, **options)
    except ff.FlipfreeError as error:
        seconds = time.process_time() - begin
        return record | {"error": f"{type(error).__name__}: {error}", "seconds": seconds}
    record["seconds"] = time.process_time() - begin
    c = result.certificate
    record |= {
        "energy": c.energy,
        "charts": result.stats["charts"],
        "mends": {mend.what: mend.count for mend in c.mends},
        "limit": bool(result.stats["time_limit_reached"]),
    }
    if "stretch" in options:
        record["bound"] = 0.5 * (options["stretch"] + 1.0 / options["stretch"])
    solid = sum(len(set(face)) == 3 for face in faces.tolist())
    wrong = [] if c.triangles == solid else ["not every face is mapped"]
    wrong += [] if c.ok and c.flips64 == c.flips32 == 0 else ["not certified"]
    if judged and len(faces) <= JUDGED_FACES:
        record["judged"] = True
        wrong += judge_any(faces, result.uv32()) + judge_any(faces, result.uv)
    return record | ({"wrong": wrong} if wrong else {})


def work(pipe: Connection, limit: float, options: dict[str, Any]) -> None:
    while task := pipe.recv():
        pipe.send(outcome(*task[:1], limit, task[1], options))


class Worker:
    """A process that may crash or hang: then the next task gets a new one."""

    def __init__(self, limit: float, options: dict[str, Any]) -> None:
        self.limit = limit
        self.options = options
        self.begin()

    def begin(self) -> None:
        self.pipe, own = multiprocessing.Pipe()
        self.process = multiprocessing.Process(
            target=work, args=(own, self.limit, self.options), daemon=True
        )
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


def judged_one(path: str, every: int) -> bool:
    return zlib.crc32(path.encode()) % every == 0


def run(options: argparse.Namespace) -> None:
    files = sorted(p for p in options.folder.rglob("*") if p.suffix.lower() in SUFFIXES)
    chosen = [str(p) for p in files if options.only in str(p)][:: options.share]
    if options.above is not None:
        before = [json.loads(line) for line in options.outcomes.read_text().splitlines()]
        bent = {r["path"] for r in before if r.get("energy", 0.0) > options.above}
        chosen = [path for path in chosen if path in bent]
        options.outcomes = options.outcomes.with_suffix(".auto.jsonl")
    tasks = iter(sorted(chosen, key=lambda path: zlib.crc32(path.encode())))
    patience = 3 * options.limit + 60
    how = {} if options.above is None else {"seams": "auto", "stretch": options.stretch}
    workers = [Worker(options.limit, how) for _ in range(options.jobs)]
    busy: list[Worker] = []
    with options.outcomes.open("w") as out:
        while True:
            for worker in [w for w in workers if w not in busy]:
                path = next(tasks, None)
                if path is not None:
                    worker.give(path, judged_one(path, options.judged))
                    busy.append(worker)
            if not busy:
                break
            wait([w.pipe for w in busy], timeout=1.0)
            for worker in list(busy):
                record = worker.answer(patience)
                if record is None:
                    continue
                busy.remove(worker)
                out.write(json.dumps(record) + "\n")
                out.flush()
                if "error" in record or "wrong" in record or record.get("seconds", 0) > 10:
                    print(json.dumps(record)[:400], flush=True)


MEANINGLESS = (
    "NaN or infinite",
    "not finite",
    "does not exist",
    "no faces",
    "uses a vertex twice",
    "No face",
)


def refused(record: dict[str, Any]) -> bool:
    error = record.get("error", "")
    return error.startswith("InvalidInput") and any(word in error for word in MEANINGLESS)


def row(name: str, group: list[dict[str, Any]]) -> str:
    mapped = [r for r in group if "energy" in r and "wrong" not in r]
    energies = [r["energy"] for r in mapped if np.isfinite(r["energy"])]
    energy = f"{statistics.median(energies):.3f}" if energies else "-"
    slowest = max(group, key=lambda r: r["seconds"])
    return (
        f"| {name} | {len(group)} | {sum(r.get('faces', 0) for r in group)} | {len(mapped)} | "
        f"{sum(map(refused, group))} | {sum('judged' in r for r in mapped)} | {energy} | "
        f"{sum(r['seconds'] for r in group):.0f} | {slowest['seconds']:.1f} |"
    )


def seams_table(records: list[dict[str, Any]]) -> int:
    """Of runs with automatic seams."""
    mapped = [r for r in records if "energy" in r and "wrong" not in r]
    above = sum(r["energy"] > r["bound"] + 1e-5 for r in mapped)
    faces, seconds = sum(r["faces"] for r in mapped), sum(r["seconds"] for r in records)
    energies, charts = ([r[key] for r in mapped] for key in ("energy", "charts"))
    print(
        "| models | faces | certified | mean energy above the bound | "
        "median energy | most | islands: median / most | seconds |\n|---|---|---|---|---|---|---|---|"
    )
    print(
        f"| {len(records)} | {faces} | {len(mapped)} | {above} | {statistics.median(energies):.4f} | "
        f"{max(energies):.4f} | {statistics.median(charts):g} / {max(charts)} | {seconds:.0f} |"
    )
    bad = [r for r in records if "wrong" in r or ("error" in r and not refused(r))]
    for r in bad + [r for r in mapped if r["energy"] > r["bound"] + 1e-5]:
        print(json.dumps(r)[:500])
    return 1 if bad else 0


def table(records: list[dict[str, Any]]) -> int:
    unreadable = [r for r in records if "unreadable" in r]
    tried = [r for r in records if "unreadable" not in r]
    kinds: dict[str, list[dict[str, Any]]] = collections.defaultdict(list)
    for r in tried:
        for kind in r.get("mends", {}):
            kinds[kind].append(r)
    print(
        "| models | number | faces | all faces mapped, certified | refused | judged again | median energy | seconds | slowest |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    clean = [r for r in tried if "mends" in r and not r["mends"]]
    rest = [r for r in tried if "mends" not in r]
    for name, group in [
        ("clean", clean),
        *sorted(kinds.items()),
        ("without a map", rest),
        ("all", tried),
    ]:
        if group:
            print(row(name, group))
    slow = [r for r in tried if r["seconds"] > 10 and r.get("faces", 0) < 20_000]
    bad = [r for r in tried if "wrong" in r or ("error" in r and not refused(r))]
    print(
        f"\n{len(unreadable)} files hold no mesh; {len(slow)} of less than 20 000 faces took more than 10 s."
    )
    for r in bad + slow:
        print(json.dumps(r)[:500])
    return 1 if bad else 0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("command", choices=["fetch", "run", "table"])
    parser.add_argument("--folder", type=Path, default=CORPORA / "files")
    parser.add_argument("--outcomes", type=Path, default=OUTCOMES)
    parser.add_argument("--share", type=int, default=1, help="only every so manieth file")
    parser.add_argument("--only", default="", help="paths with this text")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--limit", type=float, default=30.0)
    parser.add_argument("--judged", type=int, default=10)
    parser.add_argument(
        "--above", type=float, help="only files of the last run with more energy, seams found"
    )
    parser.add_argument("--stretch", type=float, default=1.25)
    options = parser.parse_args()
    if options.command == "fetch":
        fetch()
        return 0
    if options.command == "run":
        run(options)
    records = [json.loads(line) for line in options.outcomes.read_text().splitlines()]
    return seams_table(records) if options.above is not None else table(records)


if __name__ == "__main__":
    raise SystemExit(main())
