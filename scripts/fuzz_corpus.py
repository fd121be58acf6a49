# SPDX-License-Identifier: GPL-3.0-or-later
"""Fuzz inputs between text and bytes. Text is lines of hexadecimal bytes; # begins a comment.

fuzz_corpus.py to-binary FOLDER OUT     every text of FOLDER (which need not exist) as a file of OUT
fuzz_corpus.py to-text FILE OUT         one input as text
"""

import sys
from pathlib import Path


def to_binary(folder: Path, out: Path) -> None:
    for text in sorted(folder.glob("*.txt")):
        lines = (line.split("#")[0] for line in text.read_text().splitlines())
        (out / text.stem).write_bytes(bytes.fromhex("".join(lines)))


def to_text(file: Path, out: Path) -> None:
    data = file.read_bytes()
    out.write_text("".join(data[i : i + 32].hex() + "\n" for i in range(0, len(data), 32)))


if __name__ == "__main__":
    command, source, target = sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3])
    {"to-binary": to_binary, "to-text": to_text}[command](source, target)
