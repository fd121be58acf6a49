"""The file of results: one line of JSON per input, there as soon as the input is done, and what it says on resuming."""

import hashlib
import json
import os
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, BinaryIO

from .plan import Item, PlanError

if sys.platform == "win32":
    from ..process import windows

Record = dict[str, Any]

#: Best first.
STATUSES = ("certified", "warned", "refused", "failed")

#: What differs from run to run of the same work.
MEASURED = ("seconds", "peak_memory")


def beside(source: Path, kind: str) -> Path:
    """The file with an input's pins, cones or signature: bunny.obj.pins.json."""
    return source.with_name(f"{source.name}.{kind}.json")


def field_files(source: Path) -> list[Path]:
    """Where a field of an input may be: bunny.obj.rawfield."""
    return [source.with_name(source.name + end) for end in (".rawfield", ".ffield", ".rotation")]


def hash_of(source: Path) -> str | None:
    """Of the input's content and of what lies beside it, if there is anything; None if it cannot be read."""
    digest = hashlib.sha256()
    others = [beside(source, kind) for kind in ("pins", "cones", "signature")]
    for path in (source, *others, *field_files(source)):
        try:
            with path.open("rb") as file:
                digest.update(hashlib.file_digest(file, "sha256").digest())
        except OSError:
            if path is source:
                return None
    return digest.hexdigest()


def load(path: Path) -> list[Record]:
    """The whole lines; one that was cut off when its run was killed is none."""
    try:
        content = path.read_bytes()
    except OSError:  # there is none, or none can be there: writing says why
        return []
    records = []
    for line in content.split(b"\n")[:-1]:
        try:
            record = json.loads(line)
        except ValueError:
            continue
        if isinstance(record, dict) and "input" in record and record.get("status") in STATUSES:
            records.append(record)
    return records


def still_holds(record: Record, item: Item, wanted: Mapping[str, Any], content: str | None) -> bool:
    """Whether a line is what solving the item again would give.

    Args:
        wanted: what the record of this run would say of "command", "options", "versions" and "limits".
        content: hash of the input now.
    """
    target = None if item.target is None else item.target.as_posix()
    same = record.get("output") == target and record.get("hash") == content
    same = same and all(record.get(name) == wanted[name] for name in ("command", "options"))
    same = same and record.get("versions") == wanted["versions"]
    if record["status"] == "failed":  # more time or memory may help
        return same and record.get("limits") == wanted["limits"]
    written = target is None or not record.get("written") or Path(target).is_file()
    return same and written


def begun(path: Path, kept: Iterable[Record]) -> BinaryIO:
    """The file with the lines ``kept``, which replaces the old one as a whole; others are appended and there at once."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    part.write_bytes(b"".join(map(line_of, kept)))
    busy = PlanError(f"{path}: another run writes to this file. Give another one with --json.")
    try:
        part.replace(path)
    except PermissionError as error:  # Windows replaces no open file
        part.unlink()
        raise (busy if os.name == "nt" else error) from error
    file = path.open("ab", buffering=0)
    if not _locked(file):
        file.close()
        raise busy
    return file


def in_use(path: Path) -> bool:
    """Whether a run that lives writes to this file."""
    try:
        with path.open("rb") as file:
            return not _locked(file)
    except OSError:
        return False


def _locked(file: BinaryIO) -> bool:
    """Takes the file's lock, which ends with its process."""
    if sys.platform == "win32":
        return windows.lock(file)
    import fcntl

    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def line_of(record: Record) -> bytes:
    """Bytes of names that are no UTF-8 are surrogates here, and so written as JSON has them: as \\udce9."""
    text = json.dumps(record, allow_nan=False, ensure_ascii=False)
    return text.encode(errors="backslashreplace") + b"\n"
