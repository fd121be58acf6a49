# SPDX-License-Identifier: GPL-3.0-or-later
"""Work in steps, between which a window goes on: generators, whose result is what they return."""


def result_of(generator):
    """What it returns, all of its steps at once."""
    while True:
        try:
            next(generator)
        except StopIteration as end:
            return end.value
