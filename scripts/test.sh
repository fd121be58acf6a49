#!/bin/bash
# Sets up, builds and runs every test; the last line says "N passed, N failed, N skipped".
#
#   scripts/test.sh
#
# C++ (GoogleTest), the Python package (pytest), the extension inside Blender 4.3 and 5.2, without and with a window, and the checks
# of style. Skipped tests say what is missing. FLIPFREE_DATA names the shared data folder, if it is there.
set -uo pipefail
cd "$(dirname "$0")/.."
export FLIPFREE_DATA=${FLIPFREE_DATA:-$PWD/../shared/data}

step() {  # step NAME COMMAND...: runs it, says how long it took; a failure is counted, and the rest goes on
  local name=$1 start=$SECONDS status=0
  shift
  echo "== $name"
  "$@" || status=$?
  echo "== $name: $((SECONDS - start)) s$([ "$status" = 0 ] || echo ", status $status")"
  return "$status"
}
give_up() {
  echo "$1"
  echo "0 passed, 1 failed, 0 skipped"
  exit 1
}

step setup bash scripts/setup.sh || give_up "The set-up failed: see above."
reports=build/reports
rm -rf "$reports"
mkdir -p "$reports"
step build bash scripts/build.sh || give_up "The build failed: see above."

step "C++" ctest --test-dir build --output-on-failure --quiet -j "$(nproc)" --output-junit "$PWD/$reports/native.xml"
step "Python" env PYTHONPATH=build/python build/venv/bin/python -m pytest -q --junitxml "$reports/python.xml"
if step "package" bash scripts/package.sh; then
  step "Blender 4.3" bash scripts/blender-tests.sh build/blender-4.3/blender blender-4.3
  step "Blender 5.2" bash scripts/blender-tests.sh build/blender-5.2/blender blender-5.2
  step "Blender 4.3, window" bash scripts/window-tests.sh build/blender-4.3/blender blender-4.3
  step "Blender 5.2, window" bash scripts/window-tests.sh build/blender-5.2/blender blender-5.2
fi
step "style" build/venv/bin/python scripts/check_style.py "$reports/style.xml"

build/venv/bin/python scripts/totals.py "$reports" native python blender-4.3 blender-5.2 \
  blender-4.3-window blender-5.2-window style
