"""What enabling the extension takes of Blender's thread: importing its modules, and registering; CPU seconds.

    blender -b --python benchmarks/blender_enable.py

The extension must be enabled. It is taken out of the process and imported again, with the byte code that Python keeps beside the
modules, as whenever Blender starts. What Blender does once, unpacking the solver from the zip, is not part of it.
"""

import importlib
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

from blender_sheet import EXTENSION  # noqa: E402

sys.modules[EXTENSION].unregister()
for name in list(sys.modules):
    if name.startswith(EXTENSION) or name.partition(".")[0] == "flipfree":
        del sys.modules[name]
begin = time.thread_time()
extension = importlib.import_module(EXTENSION)
imported = time.thread_time()
extension.register()
print(f"imported {imported - begin:.3f}, registered {time.thread_time() - imported:.3f} CPU s")
