"""Options of the command lines, the arguments that every command of a batch has, and a run from them. What no model can be solved
with is refused before any is."""

import argparse
import contextlib
import io
import math
import os
import sys
from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, TypeVar

from .. import checks
from ..calls.conformal import LEAST_BITS, MOST_BITS
from ..checks import LARGEST_COUNT, MOST_ASPECT, Within, usable_cores
from ..quads import MOST_QUADS
from .child import Engine, Limits, NotStarted, memory_can_be_limited
from .plan import Formats, Item, PlanError, one_file, plan, shard
from .run import Progress, Work, on_dask, on_this_machine, results_in, run, sorted_out

Number = TypeVar("Number", int, float)


def real(
    least: float = -math.inf, most: float = math.inf, **bounds: float
) -> Callable[[str], float]:
    """For argparse: a number as of checks.real."""
    return _of_text(checks.real("a number", least=least, most=most, **bounds), float)


def whole(least: int, most: int = LARGEST_COUNT) -> Callable[[str], int]:
    """For argparse: a whole number within the bounds."""
    return _of_text(checks.whole(least, most), int)


def _of_text(within: Within[Number], kind: Callable[[str], Number]) -> Callable[[str], Number]:
    def number(text: str) -> Number:
        with contextlib.suppress(ValueError):
            value = within.number(kind(text))
            if value is not None:
                return value
        raise argparse.ArgumentTypeError(f"must be {within.words}, not {text!r}")

    return number


def precision(text: str) -> int:
    """For argparse: mantissa bits, 0 for as many as it takes."""
    return 0 if text in ("auto", "0") else whole(LEAST_BITS, MOST_BITS)(text)


def aspect(text: str) -> float:
    """For argparse: the shape of a texture, as one number or as two."""
    width, _, height = text.replace("x", ":").partition(":")
    try:
        value = float(width) / float(height or 1.0)
    except (ValueError, ZeroDivisionError):
        value = float("nan")
    if not 1.0 / MOST_ASPECT <= value <= MOST_ASPECT:
        raise argparse.ArgumentTypeError(
            f"must be a texture's width over its height, such as 2, 16:9 or 2048x1024, within {MOST_ASPECT:g} either way, "
            f"not {text!r}"
        )
    return value


#: Types of the options that have a value and are no word.
KINDS: dict[str, Callable[[str], Any]] = {
    "adaptive": real(0.0, 100.0),
    "aspect": aspect,
    "bound": real(above=1.0),
    "curvature": real(0.0, 1.0),
    "edge_weight": real(0.01, 1.0),
    "effort": real(0.0, 1000.0),
    "iterations": whole(0),
    "out": Path,
    "precision": precision,
    "sharp_from": real(0.0, 180.0),
    "stretch": real(above=1.0, most=100.0),
    "target": whole(1, MOST_QUADS),
    "tile": whole(1001, 1100),
    "tiles": whole(1, 100),
    **dict.fromkeys(("edge_length", "margin_pixels", "tile_size"), real(0.0)),
    **dict.fromkeys(("jobs", "texture_size", "threads", "tile_count"), whole(1)),
    **dict.fromkeys(("max_seconds", "memory", "timeout"), real(above=0.0)),
}


def add_options(parser: argparse.ArgumentParser, usage: str) -> None:
    """Those of a text, one a line, what it is after two blanks; indented lines go on.

    --quiet      a flag
    --field a|b  a choice, the first one by default
    --bound=4    a value of the type that it has above, or a word; nothing after the sign: none by default, '': no letters
    """
    for line in filter(None, usage.replace("\n    ", " ").splitlines()):
        form, _, text = line.partition("  ")
        word, _, choices = form.partition(" ")
        word, given, default = word.partition("=")
        if given:
            kind = KINDS.get(word[2:].replace("-", "_"), str)
            value = kind(default.strip("'")) if default else None
            parser.add_argument(word, type=kind, default=value, help=text)
        elif choices:
            words = choices.split("|")
            parser.add_argument(word, choices=words, default=words[0], help=text)
        else:
            parser.add_argument(word, action="store_true", help=text)


def refuse_together(options: dict[str, Any]) -> None:
    """What only several numbers are at fault for. Raises PlanError."""
    if "margin_pixels" in options and not options["margin_pixels"] < options["texture_size"] / 2:
        raise PlanError(
            f"--margin-pixels {options['margin_pixels']:g}: it must be below half of the {options['texture_size']} pixels "
            "of --texture-size. Give fewer pixels, or a larger texture."
        )
    if options.get("tiles", 1) > 1 and options.get("aspect", 1.0) != 1.0:
        raise PlanError(
            "--aspect: islands are spread over several --tiles only where these are squares. Leave one of them out."
        )


#: Of a run, not of how a model is solved.
_OF_RUN = {
    *("command", "inputs", "out", "suffix", "keep_endings", "keep_going", "jobs", "timeout"),
    *("memory", "resume", "retry", "shard", "list", "json", "quiet", "dask", "threads"),
}

_OUTPUTS = """
--out=  folder for the outputs, with the inputs' names
--suffix=  .ENDING: type of the outputs, if not that of the input
--keep-endings  with --suffix: m.stl becomes m.stl.obj, not m.obj
"""
_RUN = """
--json=  file of the results: one line of JSON per input, as each ends
--resume  go on with the results in --json
--retry  on resuming, try those that failed again
--list  say what would be done, and do nothing
--quiet  no line per model
--jobs=1  models at a time
--timeout=  most seconds for one model
--memory=  most MB for one model
--shard=  I/N: do the I-th of N shares of the inputs
--threads=  per model; default: cores / jobs
"""


def add_run_arguments(parser: argparse.ArgumentParser, *, writes: bool) -> None:
    """writes: the command has outputs."""
    text = "files, folders, patterns; @FILE: a list, one a line"
    parser.add_argument("inputs", nargs="+", metavar="INPUT", help=text)
    add_options(parser, (_OUTPUTS if writes else "") + _RUN)
    text = "solve on the workers of the Dask scheduler of this address"
    parser.add_argument("--dask", default=argparse.SUPPRESS, help=text)
    text = "after a bad model go on with the others; exit status 0"
    action = argparse.BooleanOptionalAction
    parser.add_argument("--keep-going", action=action, default=True, help=text)


def add_model_arguments(parser: argparse.ArgumentParser, *, has_limit: bool = False) -> None:
    """How models are read, and how long one is worked on, whatever is made of them. has_limit: the command has an option for
    that."""
    add_options(parser, "--no-merge  vertices that a file has twice stay apart")
    if not has_limit:
        limit = "seconds of the solver, which then returns the best map so far"
        add_options(parser, f"--max-seconds=  {limit}")


def with_lists(words: list[str], inside: tuple[Path, ...] = ()) -> list[str]:
    """Command line with the lines of each @FILE in its place, whatever bytes names have there. Raises PlanError.

    inside: the lists that `words` come from, each of which names the next one.
    """
    found: list[str] = []
    for word in words:
        if not word.startswith("@"):
            found.append(word)
            continue
        file = Path(word[1:])
        try:
            lines = file.read_bytes().splitlines()
            inner = (*inside, file.resolve())
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or str(error)
            raise PlanError(f"{word}: the list cannot be read: {reason}.") from error
        if inner[-1] in inside:
            raise PlanError(
                f"{word}: the list names itself, directly or through another list:"
                " take that line out."
            )
        found += with_lists([os.fsdecode(line) for line in lines], inner)
    return found


def is_one_file(given: argparse.Namespace) -> bool:
    """IN OUT: two names, and nothing that says where outputs go."""
    has_outputs = hasattr(given, "out") and given.out is None and given.suffix is None
    return has_outputs and len(given.inputs) == 2


def main(
    given: argparse.Namespace,
    formats: Formats,
    engine_of: Callable[[Mapping[str, Any]], Engine],
    versions: Mapping[str, str],
) -> int:
    """Carries a parsed command line out; the exit status. engine_of: settings -> engine."""
    # How models are solved: what results depend on.
    options = {name: value for name, value in sorted(vars(given).items()) if name not in _OF_RUN}
    settings = {
        "command": given.command,
        "options": options,
        "threads": given.threads or max(1, usable_cores() // given.jobs),
    }
    limits = Limits(given.timeout, given.memory)
    try:
        refuse_together(options)
        if given.memory is not None and not memory_can_be_limited():
            raise PlanError(
                "--memory: this system does not say how much a process has. Leave it out."
            )
        if is_one_file(given):
            source, target = map(Path, given.inputs)
            items = [one_file(source, target, formats, again=given.resume)]
        else:
            items = plan(
                given.inputs,
                out=getattr(given, "out", None),
                suffix=getattr(given, "suffix", None),
                formats=formats,
                writes=hasattr(given, "out"),
                keep_endings=getattr(given, "keep_endings", False),
            )
        if given.json == "-":
            raise PlanError(
                "--json -: the results of a batch are gone on with from a file. Name one."
            )
        if given.shard:
            items = shard(items, given.shard)
        said = {"command": given.command, "options": options, "versions": dict(versions)}
        work = Work(engine_of(settings), limits, {**said, "limits": asdict(limits)}, Path.cwd())
        file = Path(given.json) if given.json else None
        kept, left = sorted_out(items, work, file=file, resume=given.resume, retry=given.retry)
        if given.list:
            _print_list(items, left)
            return 0
        address = getattr(given, "dask", None)
        records = (
            on_dask(left, work, address) if address else on_this_machine(left, work, given.jobs)
        )
        with results_in(file, kept, left) as add:
            progress = Progress(None if given.quiet else sys.stderr, items, left)
            return run(records, add, progress, keep_going=given.keep_going)
    except PlanError as error:
        print(f"flipfree: {error}", file=sys.stderr)
        return 2
    except NotStarted as error:
        print(f"flipfree: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("flipfree: stopped. --resume goes on with what is left.", file=sys.stderr)
        return 130


def _print_list(items: list[Item], left: list[Item]) -> None:
    if isinstance(sys.stdout, io.TextIOWrapper):  # names are written with the bytes that they have
        sys.stdout.reconfigure(errors="surrogateescape")
    undone = {item.source for item in left}
    for item in items:
        state = f"  ({item.refusal})" if item.refusal else ""
        state = state if item.source in undone else "  (done)"
        print(f"{item.source} -> {item.target}{state}" if item.target else f"{item.source}{state}")
