"""The command line: `python -m flipfree COMMAND INPUT... --out FOLDER`, see docs/batch.md."""

import argparse
import sys

from .batch import arguments, child
from .batch.models import commands as commands  # they declare themselves
from .batch.models.model import COMMANDS, FORMATS, engine_of, unit_of, versions
from .batch.plan import PlanError


def parser() -> argparse.ArgumentParser:
    made = argparse.ArgumentParser(
        prog="python -m flipfree",
        description="Flip-free UV maps of many models, with a line of results for each.",
    )
    made.add_argument(
        "--dask", metavar="ADDRESS", help="solve on the workers of this Dask scheduler"
    )
    subparsers = made.add_subparsers(dest="command", required=True)
    for name, command in COMMANDS.items():
        added = subparsers.add_parser(name, help=command.text)
        arguments.add_run_arguments(added, writes=command.writes)
        arguments.add_model_arguments(added)
        arguments.add_options(added, command.usage)
    return made


def main(argv: list[str]) -> int:
    if argv == ["--worker"]:
        return child.serve(unit_of)
    try:
        given = parser().parse_args(arguments.with_lists(argv))
    except PlanError as error:
        print(f"flipfree: {error}", file=sys.stderr)
        return 2
    return arguments.main(given, FORMATS, engine_of, versions())


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
