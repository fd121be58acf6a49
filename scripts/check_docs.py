# SPDX-License-Identifier: GPL-3.0-or-later
"""The pages as a test: links lead somewhere, names of files and stages are real ones, no history. check_docs.py [FOLDER]

Pages are README.md and docs/**/*.md.
"""

import re
import sys
import unicodedata
from pathlib import Path

LINK = re.compile(r"\]\(([^)\s]+)\)")
HEADING = re.compile(r"^#+ +(.*)$", re.MULTILINE)
FENCE = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)
# Seven hexadecimal digits or more with a letter and a figure among them: what git calls a commit.
COMMIT = re.compile(r"(?<![\w.])(?=[0-9a-f]*[a-f])(?=[0-9a-f]*[0-9])[0-9a-f]{7,40}\b")
SOURCE = re.compile(r"`((?:[\w*]+/)*[\w*]+\.(?:h|cpp|py|sh))(?:[ `])")
FOLDERS = ("native", "addon", "scripts", "benchmarks", "tests", "cmake")
ARCHITECTURE = "docs/architecture.md"


def pages(root: Path) -> list[Path]:
    return [root / "README.md", *sorted((root / "docs").rglob("*.md"))]


def anchor(heading: str) -> str:
    """The name that a heading has in links."""
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "").strip().lower()
    kept = "".join(c for c in text if c in " -_" or unicodedata.category(c)[0] in "LNM")
    return kept.replace(" ", "-")


def anchors(text: str) -> set[str]:
    return {anchor(heading) for heading in HEADING.findall(FENCE.sub("", text))}


def broken_links(root: Path, page: Path, text: str) -> list[str]:
    broken = []
    for link in LINK.findall(FENCE.sub("", text)):
        if re.match(r"[a-z]+:", link):
            continue
        name, _, fragment = link.partition("#")
        target = (page.parent / name).resolve() if name else page.resolve()
        if not target.exists():
            broken.append(f"{page.relative_to(root)}: {link} does not exist")
        elif fragment and fragment not in anchors(target.read_text()):
            broken.append(f"{page.relative_to(root)}: {link} has no such heading")
    return broken


def unknown_sources(root: Path, page: Path, text: str) -> list[str]:
    """Names in backticks that no source file has, whatever folder it lies in."""
    unknown = []
    for name in sorted(set(SOURCE.findall(text + " "))):
        found = (root / name).exists() or any(
            next((root / folder).rglob(name), None) is not None for folder in FOLDERS
        )
        if not found:
            unknown.append(f"{page.relative_to(root)}: there is no {name}")
    return unknown


def missing_rooms(root: Path) -> list[str]:
    """Every stage of the solver has its row in the table of stages, and what has a row is there."""
    house = root / "native" / "flipfree"
    page = (root / ARCHITECTURE).read_text()
    rooms = {path.parent.relative_to(house) for path in house.rglob("*.h")}
    return [
        f"{ARCHITECTURE}: no row begins with `{stage}/`"
        for stage in sorted({room.parts[0] for room in rooms})
        if f"| `{stage}/` |" not in page
    ] + [
        f"{ARCHITECTURE}: there is no room {name}"
        for name in re.findall(r"^\| `([\w/]+)/` \|", page, re.MULTILINE)
        if not (house / name).is_dir()
    ]


def complaints(root: Path) -> list[str]:
    root = root.resolve()
    found = []
    linked: set[Path] = set()
    for page in pages(root):
        text = page.read_text()
        name = str(page.relative_to(root))
        found += broken_links(root, page, text)
        found += unknown_sources(root, page, text)
        found += [f"{name}: {commit} looks like a commit" for commit in COMMIT.findall(text)]
        links = {
            (page.parent / link.partition("#")[0]).resolve()
            for link in LINK.findall(text)
            if not link.startswith("#")
        }
        if name != ARCHITECTURE and root / ARCHITECTURE not in links:
            found.append(f"{name}: no link to the words in {ARCHITECTURE}")
        linked |= links - {page}
    found += [
        f"{page.relative_to(root)}: no page links to it"
        for page in pages(root)[1:]
        if page not in linked
    ]
    return found + missing_rooms(root)


if __name__ == "__main__":
    problems = complaints(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
    print("\n".join(problems))
    sys.exit(1 if problems else 0)
