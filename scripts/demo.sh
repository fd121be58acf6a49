#!/bin/bash
# Shows the whole way on a fresh machine: sets up, builds, gets a Blender, installs the extension, unwraps a mesh through the operator
# in `blender -b`, and draws out/demo.png: UV islands with seams, a checker on the model, distortion colours with their scale.
#
#   scripts/demo.sh [MESH]
#
# MESH: .obj, .ply, .stl, .glb or .blend. Without it, a scan-like bust that is made on the spot. Prints the certificate.
set -euo pipefail
mesh=${1:+$(realpath "$1")}
cd "$(dirname "$0")/.."

bash scripts/setup.sh
bash scripts/setup-blender.sh trixie build/blender-4.3
echo "Building (a few minutes the first time) ..."
FLIPFREE_PACKAGE_FOR=build/blender-4.3 bash scripts/package.sh

blender=$PWD/build/blender-4.3/blender
export BLENDER_USER_RESOURCES=$PWD/build/profile-demo
rm -rf "$BLENDER_USER_RESOURCES" build/demo
mkdir -p "$BLENDER_USER_RESOURCES" build/demo out
zip=$(find dist -name '*-py313.zip' | sort | tail -1)
"$blender" --command extension install-file -r user_default --enable "$zip" > build/install-demo.log 2>&1 || {
  cat build/install-demo.log >&2
  exit 1
}
# Blender says much about rendering; what it says stays in a file unless something fails.
"$blender" -b --python-exit-code 1 --python scripts/demo/in_blender.py -- build/demo ${mesh:+"$mesh"} > build/demo.log 2>&1 || {
  tail -20 build/demo.log >&2
  exit 1
}
grep -E 'vertices, |Info: |^certificate|^  ' build/demo.log | grep -v 'Saved\|Time' || true
build/venv/bin/python scripts/demo/picture.py build/demo out/demo.png
echo "See out/demo.png"
