"""Python objects in files, their arrays beside them as they lie in memory: reading one copies nothing.

count of arrays, their sizes (64-bit numbers) | the rest, pickled | each array, at a multiple of 64 bytes
"""

from __future__ import annotations

import mmap
import os
import pickle
import struct
from pathlib import Path
from typing import Any

_ALIGNED = 64


def write(path: Path, value: object) -> None:
    """Raises OSError if there is no room."""
    buffers: list[pickle.PickleBuffer] = []
    rest = pickle.dumps(value, protocol=5, buffer_callback=buffers.append)
    arrays = [buffer.raw() for buffer in buffers]
    sizes = [len(rest), *(array.nbytes for array in arrays)]
    with path.open("wb") as file:
        file.write(struct.pack(f"<Q{len(sizes)}Q", len(sizes), *sizes))
        file.write(rest)
        for array in arrays:
            file.seek(_after(file.tell()))
            file.write(array)


def read(path: Path) -> Any:
    """Only of files that this user's own processes have written: whoever writes them decides what happens here. Arrays can be
    written to, which changes no file."""
    data = _bytes_of(path)
    (count,) = struct.unpack_from("<Q", data)
    sizes = struct.unpack_from(f"<{count}Q", data, 8)
    at = 8 + 8 * count
    rest, at = data[at : at + sizes[0]], at + sizes[0]
    arrays = []
    for size in sizes[1:]:
        at = _after(at)
        arrays.append(data[at : at + size])
        at += size
    return pickle.loads(rest, buffers=arrays)


def _after(place: int) -> int:
    return -(-place // _ALIGNED) * _ALIGNED


def _bytes_of(path: Path) -> memoryview:
    with path.open("rb") as file:
        if os.name == "nt":  # which removes no file that is mapped
            return memoryview(bytearray(file.read()))
        return memoryview(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_COPY))
