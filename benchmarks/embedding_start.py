"""What `low_distortion` is for: energies of the first flip-free map by the ladder and by progressive embedding, and the
unwrap that starts from the latter.

    PYTHONPATH=build/python python3 benchmarks/embedding_start.py

Energies: mean symmetric Dirichlet (1 = isometric) of the certified 32-bit result, onto the circle, and of ff.unwrap
(boundary free). CPU seconds of all threads.
"""

from __future__ import annotations

from itertools import chain

from embedding_meshes import corpus, tube

import flipfree as ff

from cost import timed


def main() -> None:
    print("| disk | ladder: E, s | low_distortion: E, s | ff.unwrap: E, s |")
    print("|---|---|---|---|")
    for disk in chain(corpus(), [tube(8, 400)]):
        cells = [disk.name]
        for call in (
            lambda disk=disk: ff.embed(disk.vertices, disk.faces),
            lambda disk=disk: ff.embed(disk.vertices, disk.faces, low_distortion=True),
            lambda disk=disk: ff.unwrap(disk.vertices, disk.faces, seams="given"),
        ):
            with timed() as cost:
                energy = call().certificate.energy
            cells.append(f"{energy:.4g}, {cost.cpu:.2f}")
        print(f"| {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
