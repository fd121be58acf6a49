"""Arguments that every command of a batch has, and a run from them."""

from __future__ import annotations

import argparse
import io
import os
import sys
from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from ..checks import usable_cores
from . import numbers
from .child import Engine, Limits, NotStarted, memory_can_be_limited
from .plan import Formats, Item, PlanError, one_file, plan, shard
from .run import Progress, Work, on_dask, on_this_machine, results_in, run, sorted_out

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
    numbers.add_options(parser, (_OUTPUTS if writes else "") + _RUN)
    text = "solve on the workers of the Dask scheduler of this address"
    parser.add_argument("--dask", default=argparse.SUPPRESS, help=text)
    text = "after a bad model go on with the others; exit status 0"
    action = argparse.BooleanOptionalAction
    parser.add_argument("--keep-going", action=action, default=True, help=text)


def add_model_arguments(parser: argparse.ArgumentParser, *, has_limit: bool = False) -> None:
    """How models are read, and how long one is worked on, whatever is made of them. has_limit: the command has an option for
    that."""
    numbers.add_options(parser, "--no-merge  vertices that a file has twice stay apart")
    if not has_limit:
        limit = "seconds of the solver, which then returns the best map so far"
        numbers.add_options(parser, f"--max-seconds=  {limit}")


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


def options_of(given: argparse.Namespace) -> dict[str, Any]:
    """How models are solved: what results depend on."""
    return {name: value for name, value in sorted(vars(given).items()) if name not in _OF_RUN}


def main(
    given: argparse.Namespace,
    formats: Formats,
    engine_of: Callable[[Mapping[str, Any]], Engine],
    versions: Mapping[str, str],
) -> int:
    """Carries a parsed command line out; the exit status. engine_of: settings -> engine."""
    progress = Progress(None if given.quiet else sys.stderr)
    options = options_of(given)
    settings = {
        "command": given.command,
        "options": options,
        "threads": given.threads or max(1, usable_cores() // given.jobs),
    }
    limits = Limits(given.timeout, given.memory)
    try:
        numbers.refuse_together(options)
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
        runner = on_dask(address) if address else on_this_machine(given.jobs)
        with results_in(file, kept, left) as add:
            return run(items, left, work, runner, add, progress, keep_going=given.keep_going)
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
