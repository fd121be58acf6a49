# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs pytest in a Python with the package bpy: run_bpy.py ARGUMENTS OF PYTEST. scripts/bpy-tests.sh calls it."""

import os
import sys

import bpy  # isort: skip - it makes addon_utils importable
import addon_utils
import pytest

assert bpy.app.background
addon_utils.enable("bl_ext.user_default.flipfree_uv", default_set=True)
status = int(pytest.main(sys.argv[1:]))
sys.stdout.flush()
sys.stderr.flush()
os._exit(status)  # some crash when they are taken apart
