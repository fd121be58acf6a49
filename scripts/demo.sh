#!/bin/bash
# Shows the whole way on a fresh machine: sets up, builds, gets a Blender, installs the extension, unwraps meshes through the operator
# in `blender -b`, and draws out/demo.png: layouts and a checker on the model, by Auto Unwrap and by Smart UV Project.
#
#   scripts/demo.sh [MESH | sheet]
#
# MESH: .obj, .ply, .stl, .glb or .blend. Without it, three models that are made on the spot; sheet: a dozen more. Prints the certificate.
set -euo pipefail
mesh=${1:-}
[ "$mesh" = sheet ] || mesh=${mesh:+$(realpath "$mesh")}
cd "$(dirname "$0")/.."
source scripts/steps.sh

step "Tools and libraries" bash scripts/setup.sh
step "Blender 4.3" bash scripts/setup-blender.sh trixie build/blender-4.3
step "Build of the solver and of one Python module" env FLIPFREE_PACKAGE_FOR=build/blender-4.3 bash scripts/package.sh

blender=$PWD/build/blender-4.3/blender
export BLENDER_USER_RESOURCES=$PWD/build/profile-demo
rm -rf "$BLENDER_USER_RESOURCES" build/demo
mkdir -p "$BLENDER_USER_RESOURCES" build/demo out
zip=$(find dist -maxdepth 1 -name '*-linux_*-py313.zip' | sort -V | tail -1)

logged() {  # logged LOG COMMAND...: Blender says much; what it says stays in a file unless something fails
  local log=$1
  shift
  "$@" > "$log" 2>&1 || { tail -20 "$log" >&2; return 1; }
}
step "Extension into Blender" logged build/install-demo.log \
  "$blender" --command extension install-file -r user_default --enable "$zip"
step "Unwrap in Blender" logged build/demo.log \
  "$blender" -b --python-exit-code 1 --python scripts/demo/in_blender.py -- build/demo ${mesh:+"$mesh"}
grep -E 'vertices, |Info: |^certificate|^  ' build/demo.log | grep -v 'Saved\|Time' || true
step "Picture" build/venv/bin/python scripts/demo/picture.py build/demo out/demo.png
echo "See out/demo.png"
