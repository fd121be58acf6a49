# SPDX-License-Identifier: GPL-3.0-or-later
"""`blender -b -c flipfree ...` without a Blender: python flipfree_bpy.py COMMAND INPUT... with the package bpy.

The extension must be installed (docs/batch.md): python flipfree_bpy.py --install flipfree_uv-VERSION-linux_x64-py311.zip
"""

import sys

import bpy  # isort: skip - it makes addon_utils importable
import addon_utils

EXTENSION = "bl_ext.user_default.flipfree_uv"


def main(arguments: list[str]) -> int:
    if arguments[:1] == ["--install"]:
        done = bpy.ops.extensions.package_install_files(
            filepath=arguments[1], repo="user_default", enable_on_install=True
        )
        return 0 if done == {"FINISHED"} else 1
    module = addon_utils.enable(EXTENSION, default_set=True)
    if module is None:
        print("Flipfree UV is not installed: flipfree_bpy.py --install ZIP", file=sys.stderr)
        return 2
    return module.command_line.main(arguments)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
