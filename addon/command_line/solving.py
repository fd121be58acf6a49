# SPDX-License-Identifier: GPL-3.0-or-later
"""All objects of a loaded file through one command, as the operator would."""

import argparse
from dataclasses import dataclass

from flipfree.batch.child import in_command_line_terms

from .. import aspect, errors, modal, records
from ..meshes import mesh_io
from ..operators import layout
from . import commands


@dataclass
class Ended:
    """tasks: of objects that got their map. record: for the file of results. text: a line for people."""

    record: dict
    text: str
    failure: errors.Failure | None = None
    task: modal.Task | None = None


def solve(objects, operator, given) -> list[Ended]:
    """One for each object; those that got a map have it in their mesh. given: parsed options of the operator's command."""
    if getattr(given, "aspect", 1.0) == commands.IMAGE:
        seen = next(filter(None, map(aspect.of_material, objects)), 1.0)
        given = argparse.Namespace(**{**vars(given), "aspect": seen})
    values = commands.values_of(operator, given)
    tasks, failures = [], []
    for ob in objects:
        try:
            tasks.append(operator.make_task(mesh_io.read(ob, only_selected=False), **values))
        except mesh_io.MeshProblem as problem:
            failures.append(errors.from_problem(ob.name, problem))
    # This is no session that another process would save.
    run = modal.Run(tasks, failures, layout=layout.of_tasks(tasks), separate=False)
    while not run.advance(1.0):
        pass
    run.finish()
    ended = []
    for task in run.done:
        line = operator.summary([task])
        warning = in_command_line_terms(operator.advice(None, [task]) or "")
        text = f"{line}. Warning: {warning}" if warning else line
        record = records.of_task(task, line, warning)
        ended.append(Ended(record, f"{task.snapshot.object_name}: {text}", task=task))
    for failure in run.failures:
        failure.message = in_command_line_terms(failure.message)
        ended.append(Ended(records.of_failure(failure), str(failure), failure=failure))
    return ended
