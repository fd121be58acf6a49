"""Random layouts through ff.pack: does the slow judge find an overlap or a gap that is too small, as stored?

    random_layouts.py, and what driver.py says

Kinds, numbers of islands, margins, rotations, efforts and tiles at random; some islands are made much larger or smaller, thin,
or far away.
"""

from __future__ import annotations

import sys

import numpy as np
from driver import main
from packing_layouts import drawn

import flipfree as ff

from judges import gaps
from verdict import Finding

KINDS = ("blobs", "letters", "rings", "sizes", "mixed")
LIMIT = 60.0


def case(seed: int, _slack: float, said: list[str]) -> str:
    random = np.random.default_rng(seed)
    layout = drawn(str(random.choice(KINDS)), int(random.integers(1, 60)), seed=seed)
    uv = np.array(layout.uv, float)
    for island in np.flatnonzero(random.random(layout.islands) < 0.1):
        own = layout.island == island
        uv[own] *= 10.0 ** random.uniform(-4, 4)
        if random.random() < 0.3:
            uv[own, :, 0] *= 10.0 ** random.uniform(-3, 0)
        uv[own] += random.normal(size=2) * 10.0 ** random.uniform(-2, 4)
    pixels = float(random.choice([0.0, 1.0, 2.0, 8.0, 32.0]))
    options = {
        "margin_pixels": pixels,
        "texture_size": int(random.choice([256, 1024, 4096])),
        "rotation": str(random.choice(["free", "quarters", "none"])),
        "effort": float(random.choice([0.0, 0.05, 0.2, 1.0])),
        "scale_true": bool(random.random() < 0.5),
        "tiles": int(random.choice([1, 1, 1, 2, 5])),
    }
    said.append(str(options))
    try:
        packed = ff.pack(layout.vertices, layout.faces, uv, max_seconds=LIMIT, threads=1, **options)
    except ff.NotConverged as error:
        return error.code
    except ff.FlipfreeError as error:
        if error.code not in ("bad option", "flipped map"):
            raise Finding(f"{error.code}: {error}") from None
        return error.code
    # So many islands get no more (unwrap/packing).
    most = 0.899 / (np.ceil(np.sqrt(layout.islands)) + 1)
    margin = min(pixels / options["texture_size"], most)
    stored = packed.uv32().astype(np.float64)
    found = [stored[layout.island == i] for i in range(layout.islands)]
    gap = gaps.narrowest(found, max(margin, 1e-6))
    wrong = []
    if not (gap.distance >= margin and gap.distance > 0.0):
        wrong.append(f"gap {gap} for a margin of {margin}")
    within = [i - np.floor(i.reshape(-1, 2).mean(axis=0)) for i in found]  # each in its own tile
    low, high = min(i.min() for i in within), max(i.max() for i in within)
    tiles = {tuple(np.floor(i.reshape(-1, 2).mean(axis=0)).astype(int)) for i in found}
    if tiles != {(k, 0) for k in range(min(options["tiles"], layout.islands))}:
        wrong.append(f"tiles {sorted(tiles)}")
    if low < margin / 2 or high > 1.0 - margin / 2:
        wrong.append(f"from {low} to {high} for a margin of {margin}")
    if not packed.certificate.ok or packed.certificate.flips32:
        wrong.append(f"certificate: {packed.certificate.failures}")
    # Of a margin that was lowered the statistics mean the whole, `most` a little less.
    lowered = pixels / options["texture_size"] > most
    if not wrong and not lowered and not packed.stats["margin_met"]:
        wrong.append("the margin is met, and the statistics deny it")
    if wrong:
        raise Finding("; ".join(wrong))
    return "packed"


if __name__ == "__main__":
    sys.exit(main(__doc__, case))
