# SPDX-License-Identifier: GPL-3.0-or-later
"""Both command lines take the same options, but for what only one of them knows."""

import argparse
import functools

import pytest

from flipfree.batch import arguments
from flipfree.batch.models import commands as commands  # they declare themselves
from flipfree.batch.models.model import COMMANDS

# Of Blender's files: pins, cones, seams and attributes are marked there, or written there.
IN_BLENDER = {
    *("attribute", "boundary_selected", "density", "density_from", "density_ratio", "ignore_pins"),
    *(
        "group_by",
        "share_tile",
        "keep_placement",
        "mark_seams",
        "no_cones",
        "no_field",
        "no_seams",
        "no_shape",
    ),
    # Of islands, which files without seams do not have.
    *("pack", "metric_scale", "no_pack", "margin_pixels", "texture_size"),
}
# Of files without marks: cones are chosen or suggested on the way; charts of the file.
IN_PACKAGE = {"bound", "cones", "keep_charts", "max_seconds"}


def options(add):
    parser = argparse.ArgumentParser()
    add(parser)
    return {a.dest: a for a in parser._actions if a.dest != "help"}


@pytest.mark.parametrize("name", sorted(COMMANDS))
def test_both_command_lines_have_the_same_options(part, name):
    table = part("command_line.commands")
    ours = options(functools.partial(table.add_options, table.COMMANDS[name]))
    theirs = options(lambda parser: arguments.add_options(parser, COMMANDS[name].usage))
    assert ours.keys() - theirs.keys() <= IN_BLENDER | {"max_seconds"}, name
    assert theirs.keys() - ours.keys() <= IN_PACKAGE, name
    for word in ours.keys() & theirs.keys():
        if theirs[word].choices:
            assert set(theirs[word].choices) <= set(ours[word].choices) | {"none"}, (name, word)
        if word not in ("bound", "boundary"):
            assert ours[word].default == theirs[word].default, (name, word)
