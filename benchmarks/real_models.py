"""Meshes that no one here made, and broken ones made at random: is every face mapped, what does a slow judge say, how long does it take?

    real_models.py fetch                          Debian's packages, unpacked below build/corpora (some 2 GB of downloads)
    real_models.py files [--share 1] [--jobs 2]   every file of these packages is one mesh, unwrapped on one thread
    real_models.py generated [--meshes 10000] [--seed 0]      tests/python/broken_meshes.py
    real_models.py scans [--meshes 10000] [--seed 0]          scans and imports with what is wrong with such, by the defaults

scans: rough surfaces of 1000 to 17 000 triangles, mapped without an option; named: the certificate's verdict is not "fine".

One file in ten, of up to 4000 faces, is judged by `judges.any_triangles`, which shares no code with ours, on the 64-bit and on the
32-bit values; all of the generated ones are. Exit status 1 at a refusal other than of coordinates that are not finite, indices out of
range and no faces, and at a crash, a face that is not mapped, a flip, a point covered twice.
"""

from __future__ import annotations

import json
import multiprocessing
import statistics
import subprocess
import sys
import zipfile
import zlib
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from broken_meshes import Mesh, Random, broken_mesh
from model_files import SUFFIXES, Unreadable, read_model
from runner import Options, Row, main, table, timed

import flipfree as ff
from flipfree.batch.child import Engine, Limits, Unit, serve
from flipfree.batch.plan import Item
from flipfree.batch.run import Work, on_this_machine
from flipfree.distortion import BOUND_ENERGY

from judges.any_triangles import judge_any
from mesh_files import ROOT
from surfaces import bumpy_grid, octahedron_sphere, torus

CORPORA = ROOT / "build" / "corpora"

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
#: JSON has no infinity.
MOST = sys.float_info.max


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


def mapped(vertices: Any, faces: Any, judged: bool, limit: float) -> dict[str, Any]:
    """What became of a mesh."""
    with timed() as cost:
        try:
            how = {"max_seconds": limit, "threads": 1, "seams": "given"}
            result, error = ff.unwrap(vertices, faces, **how), ""
        except ff.FlipfreeError as given:
            result, error = None, f"{type(given).__name__}: {given}"
    record: dict[str, Any] = {"faces": len(faces), "cpu": cost.cpu}
    if result is None:
        return record | {"error": error}
    c = result.certificate
    record |= {"energy": min(c.energy, MOST), "charts": result.stats["charts"]}
    record["mends"] = [mend.what for mend in c.mends]
    solid = sum(len(set(face)) == 3 for face in faces.tolist())
    wrong = [] if c.triangles == solid else ["not every face is mapped"]
    wrong += [] if c.ok and c.flips64 == c.flips32 == 0 else ["not certified"]
    if judged:
        record["judged"] = True
        wrong += judge_any(faces, result.uv32()) + judge_any(faces, result.uv)
        wrong += ff.certify(vertices, faces, result.uv).failures
    return record | ({"wrong": wrong} if wrong else {})


def unit_of(settings: Mapping[str, Any]) -> Unit:
    """In a process of its own, which may crash or hang: then the next file gets a new one."""

    def unit(source: Path, _: Path | None) -> dict[str, Any]:
        try:
            vertices, faces = read_model(source)
        except Unreadable as error:
            return {"status": "certified", "unreadable": str(error)}
        judged = draw(source) % 10 == 0 and len(faces) <= JUDGED_FACES
        return {"status": "certified"} | mapped(vertices, faces, judged, settings["seconds"])

    return unit


def draw(path: Path | str) -> int:
    """The same for a file in every run."""
    return zlib.crc32(str(path).encode())


def outcomes(paths: list[str], options: Options) -> Iterator[dict[str, Any]]:
    engine = Engine([sys.executable, __file__, "--worker"], {}, {"seconds": options.seconds})
    work = Work(engine, Limits(3 * options.seconds + 60), {}, Path("/"))
    items = [Item(Path(path), None) for path in sorted(paths, key=draw)]
    for told in on_this_machine(items, work, options.jobs):
        lost = {"error": told["reason"]} if told["status"] == "failed" else {}
        record = {"path": told["input"], **told, **lost}
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
    energies = [r["energy"] for r in good]
    charts = [r["charts"] for r in good]
    seconds = [r.get("cpu", r.get("seconds", 0.0)) for r in group]  # of a crash those of the clock
    yield from (name, len(group), sum(r.get("faces", 0) for r in group), len(good))
    yield from (sum(map(refused, group)), sum("judged" in r for r in good))
    yield f"{statistics.median(energies):.3f}" if energies else "-"
    yield f"{statistics.median(charts):g}, {max(charts)}" if charts else "-"
    yield from (f"{sum(seconds):.0f}", f"{max(seconds):.1f}")


@table(COLUMNS)
def files(options: Options) -> Iterator[Row]:
    found = sorted(p for p in (CORPORA / "files").rglob("*") if p.suffix.lower() in SUFFIXES)
    chosen = [str(p) for p in options.cases(found[:: options.share])]
    tried = [r for r in outcomes(chosen, options) if "unreadable" not in r]
    kinds: dict[str, list[dict[str, Any]]] = defaultdict(list)
    for r in tried:
        for kind in r.get("mends", ["without a map"]) or ["clean"]:
            kinds[kind].append(r)
    for kind, group in sorted(kinds.items()):
        yield row(kind, group)
    if tried:
        yield row("all", tried)


def made_and_mapped(seed: int) -> tuple[str, dict[str, Any]]:
    kind, (vertices, faces) = broken_mesh(seed)
    return kind, mapped(vertices, np.asarray(faces), True, 60.0)


def by_kind(
    work: Callable[[int], tuple[str, dict[str, Any]]], options: Options
) -> Iterator[tuple[str, list[dict[str, Any]]]]:
    """What became of the meshes of all seeds, by kind, and of all."""
    kinds: dict[str, list[dict[str, Any]]] = defaultdict(list)
    seeds = range(options.seed, options.seed + options.meshes)
    with multiprocessing.Pool(options.jobs) as pool:
        made = pool.imap(work, seeds, chunksize=8)
        for seed, (kind, record) in zip(seeds, made, strict=True):
            kinds[kind].append(record)
            if "wrong" in record or "error" in record:
                options.fail(f"seed {seed} ({kind}): {record}")
    yield from ((kind, kinds[kind]) for kind in options.cases(sorted(kinds)))
    yield "all", sum(kinds.values(), [])


@table(COLUMNS)
def generated(options: Options) -> Iterator[Row]:
    for kind, group in by_kind(made_and_mapped, options):
        yield row(kind, group)


def balls(random: Random) -> Mesh:
    return octahedron_sphere(int(random.integers(4, 6)))


def busts(random: Random) -> Mesh:
    """Open below."""
    vertices, faces = balls(random)
    return vertices, faces[(vertices[faces][:, :, 2] > -0.6).all(axis=1)]


def blocks(random: Random) -> Mesh:
    """Boxes with round edges."""
    vertices, faces = balls(random)
    size = random.uniform(0.4, 1.5, 3)
    return size * vertices / np.linalg.norm(vertices, 12, axis=1)[:, None], faces


def vessels(random: Random) -> Mesh:
    return torus(int(random.integers(40, 120)), int(random.integers(20, 60)))


def grounds(random: Random) -> Mesh:
    sides = random.integers(25, 90, 2)
    return bumpy_grid(int(sides[0]), int(sides[1]))


def rough(mesh: Mesh, random: Random) -> Mesh:
    """As a scanner sees it: hills of all sizes, and noise."""
    vertices, faces = np.array(mesh[0], float), np.array(mesh[1], np.int64)
    size = float(np.ptp(vertices, axis=0).max())
    for octave in range(4):
        ways = random.normal(0.0, 2.0 * 2**octave / size, (3, 3))
        phase = random.uniform(0.0, 2.0 * np.pi, 3)
        vertices = vertices + 0.04 * size / 2**octave * np.sin(vertices @ ways + phase)
    return vertices + random.normal(0.0, 3e-4 * size, vertices.shape), faces


def pinholes(mesh: Mesh, which: Any, _: Random) -> Mesh:
    return mesh[0], np.delete(mesh[1], which, axis=0)


def dirty_welds(mesh: Mesh, which: Any, random: Random) -> Mesh:
    """Corners with vertices of their own, at the place of the others or nearly."""
    vertices, faces = mesh
    corner = random.integers(0, 3, len(which))
    off = random.choice([0.0, 1e-6], (len(which), 1)) * random.normal(0.0, 1.0, (len(which), 3))
    own = np.arange(len(vertices), len(vertices) + len(which))
    vertices = np.vstack([vertices, vertices[faces[which, corner]] + off])
    faces[which, corner] = own
    return vertices, faces


def needles(mesh: Mesh, which: Any, random: Random) -> Mesh:
    """Edges divided near one end, on both sides."""
    vertices, faces = mesh
    face_of = {(f[k], f[(k + 1) % 3]): i for i, f in enumerate(faces.tolist()) for k in range(3)}
    points, found, gone = [], [], set()
    for i in which.tolist():
        a, b, c = faces[i].tolist()
        j = face_of.get((b, a), i)
        if i in gone or j in gone or i == j:
            continue
        gone |= {i, j}
        (d,) = set(faces[j].tolist()) - {a, b}
        n = len(vertices) + len(points)
        points.append(vertices[a] + 10.0 ** random.uniform(-6, -2) * (vertices[b] - vertices[a]))
        found += [(a, n, c), (n, b, c), (n, a, d), (b, n, d)]
    return np.vstack([vertices, *points]), np.vstack([np.delete(faces, list(gone), axis=0), found])


def duplicates(mesh: Mesh, which: Any, _: Random) -> Mesh:
    return mesh[0], np.vstack([mesh[1], mesh[1][which]])


def turned(mesh: Mesh, which: Any, _: Random) -> Mesh:
    mesh[1][which] = mesh[1][which][:, ::-1]
    return mesh


def slivers(mesh: Mesh, which: Any, random: Random) -> Mesh:
    """Vertices that lie nearly on the opposite side."""
    vertices, faces = mesh
    share = 1.0 - 10.0 ** random.uniform(-6, -2, (len(which), 1))
    a, b, c = (vertices[faces[which, k]] for k in range(3))
    vertices[faces[which, 0]] = a + share * (0.5 * (b + c) - a)
    return vertices, faces


BASES = (balls, busts, blocks, vessels, grounds)
ILLS = (pinholes, dirty_welds, needles, duplicates, turned, slivers)


def scan(seed: int) -> tuple[str, Mesh]:
    random = np.random.default_rng(seed)
    mesh = rough(BASES[seed % len(BASES)](random), random)
    kind = seed // len(BASES) % (len(ILLS) + 1)
    chosen = ILLS[kind : kind + 1] or ILLS
    for ill in chosen:
        count = max(int(10.0 ** random.uniform(-3.0, -1.5) * len(mesh[1])), 1)
        mesh = ill(mesh, random.choice(len(mesh[1]), count, replace=False), random)
    return chosen[0].__name__.replace("_", " ") if len(chosen) == 1 else "all of these", mesh


def scanned_and_mapped(seed: int) -> tuple[str, dict[str, Any]]:
    kind, (vertices, faces) = scan(seed)
    with timed() as cost:
        try:
            found = ff.unwrap(vertices, faces, threads=1)
        except ff.FlipfreeError as error:
            return kind, {"error": f"{type(error).__name__}: {error}"}
    c = found.certificate
    record = {"faces": len(faces), "seconds": cost.cpu, "energy": c.energy, "poor": c.poor}
    record |= {"charts": found.stats["charts"], "needles": c.needles > 0}
    wrong = [] if c.ok and c.flips64 == c.flips32 == 0 else ["not certified"]
    wrong += [f"energy {c.energy} is not named"] if c.energy > BOUND_ENERGY and not c.poor else []
    return kind, record | ({"wrong": wrong} if wrong else {})


@table(
    "what is wrong | models | triangles | certified | energy: median | largest | above 1.03 | of these named | with needles"
    " | islands: median | CPU s"
)
def scans(options: Options) -> Iterator[Row]:
    for kind, group in by_kind(scanned_and_mapped, options):
        good = [r for r in group if "energy" in r and "wrong" not in r]
        energies = [r["energy"] for r in good]
        above = [r for r in good if r["energy"] > BOUND_ENERGY]
        yield (
            *(kind, len(group), sum(r.get("faces", 0) for r in group), len(good)),
            *(f"{statistics.median(energies):.3f}", f"{max(energies):.3f}", len(above)),
            *(sum(r["poor"] for r in above), sum(r["needles"] for r in good)),
            *(f"{statistics.median(r['charts'] for r in good):g}",),
            f"{sum(r.get('seconds', 0.0) for r in group):.0f}",
        )


if __name__ == "__main__":
    if sys.argv[1:] == ["fetch"]:
        sys.exit(fetch())
    if sys.argv[1:] == ["--worker"]:
        sys.exit(serve(unit_of))
    main(
        __doc__,
        share=(1, "only every so manieth file"),
        jobs=(2, ""),
        meshes=(10_000, "of generated and scans"),
        seed=(0, "of generated and scans"),
    )
