"""What is to be done: files, folders and patterns -> items, each with its output, before anything is solved; and what lies beside
an input and belongs to it."""

import glob
import hashlib
import os
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

Record = dict[str, Any]

#: Complaints of one kind that are listed one by one.
_MOST_LISTED = 5

#: Reason of a record: the input or its output is a file of a type that cannot be read or written.
OTHER_KIND = "file type"


class PlanError(ValueError):
    """The command line cannot be carried out as it stands; nothing was solved."""


@dataclass(frozen=True)
class Item:
    """One input file. ``target`` is None where nothing is written. ``refusal``: why it is not even tried; else empty."""

    source: Path
    target: Path | None
    refusal: str = ""


@dataclass(frozen=True)
class Formats:
    """Endings in lower case, with the dot."""

    reads: tuple[str, ...]
    writes: tuple[str, ...]


def plan(
    inputs: Sequence[str],
    *,
    out: Path | None,
    suffix: str | None,
    formats: Formats,
    writes: bool,
    keep_endings: bool = False,
) -> list[Item]:
    """All items in the order of their names. Files of types that cannot be read or written are refused one by one, so that
    they do not cost the others.

    Args:
        inputs: files, folders (with all below them) and patterns.
        out: folder of the outputs, which have the inputs' names and, for folders and patterns, their places below them; None:
            beside the inputs.
        suffix: ending of the outputs; None: that of the input.
        keep_endings: a suffix that is another than the input's comes after it: m.stl.obj.
        writes: whether there are outputs at all.

    Raises:
        PlanError: what is not there, nothing that can be read and written, two inputs for one output, an input that would be
            overwritten.
    """
    if writes and out is None and suffix is None:
        raise PlanError(
            "Say where the maps go: --out FOLDER (same names there), or --suffix .ENDING (beside the inputs)."
        )
    if suffix is not None and suffix.lower() not in formats.writes:
        raise PlanError(
            f"--suffix {suffix}: texture coordinates cannot be written to files of this type. "
            f"Use {', '.join(formats.writes)}."
        )
    found: dict[str, tuple[Path, Path]] = {}  # absolute path -> (source, place below its root)
    for text in inputs:
        for source, place in _expanded(text, formats, out):
            found.setdefault(os.path.abspath(source), (source, place))
    items = [
        _item(
            source, _target(source, place, out, suffix, keep_endings) if writes else None, formats
        )
        for source, place in found.values()
    ]
    if all(item.refusal for item in items):
        paths = listed([item.source for item in items])
        raise PlanError(f"{paths}: {' '.join(sorted({item.refusal for item in items}))}")
    _refuse_conflicts(items, suffix if keep_endings else None)
    return sorted(items, key=lambda item: item.source.as_posix())


def _expanded(text: str, formats: Formats, out: Path | None) -> Iterator[tuple[Path, Path]]:
    path = Path(text)
    if path.is_dir():
        files: Iterable[Path] = path.rglob("*")
        yield from _models(text, path, files, formats, out)
    elif path.is_file():
        yield path, Path(path.name)
    elif glob.has_magic(text):
        steady = re.split(r"[*?\[]", text, maxsplit=1)[0]
        root = Path(steady if steady.endswith(("/", os.sep)) else os.path.dirname(steady))
        files = (Path(found) for found in glob.iglob(text, recursive=True))
        yield from _models(text, root, files, formats, out)
    else:
        raise PlanError(f"{text}: there is no such file or folder.")


def _models(
    text: str, root: Path, files: Iterable[Path], formats: Formats, out: Path | None
) -> Iterator[tuple[Path, Path]]:
    """Those of the files that are models; hidden ones and what lies in the folder of outputs are passed over."""
    outputs = None if out is None or _same(root, out) else out.resolve()
    count = 0
    for file in files:
        place = file.relative_to(root)
        hidden = any(part.startswith(".") for part in place.parts)
        if hidden or file.suffix.lower() not in formats.reads or not file.is_file():
            continue
        if outputs is not None and outputs in file.resolve().parents:
            continue
        count += 1
        yield file, place
    if count == 0:
        raise PlanError(f"{text}: no models are there (files {', '.join(formats.reads)}).")


def _same(a: Path, b: Path) -> bool:
    return a.resolve() == b.resolve()


def _target(
    source: Path, place: Path, out: Path | None, suffix: str | None, keep_endings: bool
) -> Path:
    target = source if out is None else out / place
    if suffix is None:
        return target
    if not keep_endings:
        return target.with_suffix(suffix)
    changes = target.suffix.lower() != suffix.lower()
    return target.with_name(target.name + suffix) if changes else target


def _item(source: Path, target: Path | None, formats: Formats) -> Item:
    """Refused, without a target, where files of such types cannot be read or written."""
    if source.suffix.lower() not in formats.reads:
        use = ", ".join(formats.reads)
        return Item(source, None, f"{_kind(source)} cannot be read. Use {use}.")
    if target is not None and target.suffix.lower() not in formats.writes:
        use = f"Add --suffix with one of {', '.join(formats.writes)}."
        return Item(source, None, f"{_kind(target)} hold no texture coordinates. {use}")
    return Item(source, target)


def _kind(path: Path) -> str:
    return f"{path.suffix.lower()} files" if path.suffix else "files without an ending"


def _refuse_conflicts(items: list[Item], added: str | None) -> None:
    """added: the suffix that comes after the inputs' own endings."""
    sources = {_key(item.source): item.source for item in items}
    takers: dict[str, Path] = {}
    for item in items:
        if item.target is None:
            continue
        key = _key(item.target)
        if key in sources:
            own = "itself" if sources[key] == item.source else str(sources[key])
            raise PlanError(
                f"{item.source}: its output {item.target} would overwrite the input {own}. "
                "Give another folder with --out, or another --suffix."
            )
        if key in takers:
            raise PlanError(
                f"{takers[key]} and {item.source} have the same output, {item.target}. "
                + _cure_of_one_output(takers[key], item, added)
            )
        takers[key] = item.source


def _cure_of_one_output(other: Path, item: Item, added: str | None) -> str:
    if not _same(other.parent, item.source.parent):
        return "Give the folder that holds both, so that their places below it are kept."
    if added is not None:
        return "Rename one of them."
    assert item.target is not None
    name = f"{item.source.name}{item.target.suffix}"
    if item.source.suffix.lower() == item.target.suffix.lower():
        name = f"{other.name}{item.target.suffix}"
    return f"Add --keep-endings, so that outputs of another type keep their inputs' whole names: {name}."


def _key(path: Path) -> str:
    return os.path.normcase(os.path.realpath(path))


def listed(paths: Sequence[Path | str]) -> str:
    more = f" and {len(paths) - _MOST_LISTED} more" if len(paths) > _MOST_LISTED else ""
    return ", ".join(map(str, paths[:_MOST_LISTED])) + more


def shard(items: list[Item], share: str) -> list[Item]:
    """The i-th of n shares, ``share`` being "i/n" with i from 1: together all items, each once."""
    numbers = re.fullmatch(r"(\d+)/(\d+)", share)
    index, count = (int(n) for n in numbers.groups()) if numbers else (0, 0)
    if not 1 <= index <= count:
        raise PlanError(f"--shard {share}: give i/n with i from 1 to n, such as 1/4.")
    return items[index - 1 :: count]


def one_file(source: Path, target: Path, formats: Formats, *, again: bool = False) -> Item:
    """IN OUT: one input with an output of its own name. again: it may be there from a former run. Raises PlanError."""
    several = "For several inputs say where the maps go (--out FOLDER)"
    if source.is_dir() or (glob.has_magic(str(source)) and not source.exists()):
        raise PlanError(f"{source}: IN OUT maps one file. {several}.")
    if not source.is_file():
        raise PlanError(f"{source}: there is no such file.")
    if target.exists() and (_same(source, target) or not (again and target.is_file())):
        raise PlanError(f"{target} is there already. {several}; else delete it.")
    item = _item(source, target, formats)
    if not item.refusal:
        return item
    if source.suffix.lower() in formats.reads:
        raise PlanError(
            f"{target}: {_kind(target)} hold no texture coordinates. Use {', '.join(formats.writes)}."
        )
    raise PlanError(f"{source}: {item.refusal}")


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
