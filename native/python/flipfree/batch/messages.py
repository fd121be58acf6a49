"""Messages in the words of the command line: what the package names by its arguments, users give as options."""

from __future__ import annotations

import re

#: Argument of the package, or words of Blender's windows -> option.
_WORDS = {
    r"\bmax_seconds = ": "--max-seconds ",
    r"\(max_seconds\)": "(--max-seconds)",
    r"\bmax_seconds\b": "--max-seconds",
    r"\bmargin_pixels\b": "--margin-pixels",
    r"\btexture_size\b": "--texture-size",
    r"\bthreads\b(?= must)": "--threads",
    r"\bmargin\b(?= must)": "--margin",
    r"\bbound\b(?= must)": "--bound",
    r"\biterations\b(?= must)": "--iterations",
    r"Allow more time in the redo panel": "Allow more time with --max-seconds",
    r"Change them in the redo panel": "Change the options of the command",
    r"[Tt]urn on Cut Open in the redo panel": "give --cut-open",
    r"Turn on May Add Vertices in the redo panel": "Leave --no-new-vertices out",
    r"allow stacked ones in the redo panel": "allow stacked ones with --allow-stacked",
    r"in the redo panel": "with the options of the command (--help)",
}


def in_command_line_terms(text: str, max_seconds: float | None = None) -> str:
    """max_seconds: as given, where solvers got a part of it."""
    if max_seconds is not None:
        text = re.sub(r"\bmax_seconds = [\d.e+-]*\d", f"max_seconds = {max_seconds:g}", text)
    for words, option in _WORDS.items():
        text = re.sub(words, option, text)
    return text
