# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs pytest inside Blender: blender -b --python-exit-code 1 --python run.py -- PYTEST_FOLDER [pytest arguments].

PYTEST_FOLDER holds pytest itself (pip --target), as Blender's Python has none. The process is left through os._exit: Blender
4.3 may crash while Python is being finalised, which says nothing about the tests.
"""

import os
import sys

folder, *arguments = sys.argv[sys.argv.index("--") + 1 :]
sys.path.insert(0, folder)
sys.dont_write_bytecode = True

import pytest  # noqa: E402

status = int(pytest.main(arguments))
sys.stdout.flush()
sys.stderr.flush()
os._exit(status)
