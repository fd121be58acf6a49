#!/bin/bash
# Runs the tests that need a window, on a virtual screen with software GL.
#
#   scripts/window-tests.sh BLENDER NAME [SHOTS [WORD ...]]
#
# Uses the profile that scripts/blender-tests.sh made for NAME; report in build/reports/NAME-window.xml. SHOTS: folder for pictures.
# WORDs: only tests with one of them in their names.
set -euo pipefail
cd "$(dirname "$0")/.."
blender=$(realpath -s "${1:?usage: window-tests.sh BLENDER NAME [SHOTS [WORD ...]]}")
name=${2:?usage: window-tests.sh BLENDER NAME [SHOTS]}
shots=${3:-}
report=$PWD/build/reports/$name-window.xml
mkdir -p build/reports
if ! command -v xvfb-run >/dev/null; then
  echo "xvfb-run is missing (apt install xvfb xauth): the tests with a window are skipped"
  echo '<testsuite name="window"><testcase name="window"><skipped message="xvfb-run is missing"/></testcase></testsuite>' > "$report"
  exit 0
fi
# Software draws every pixel: few of them where nobody looks, and by one thread, as two Blenders run side by side.
size=(960 600)
if [ -n "$shots" ]; then
  size=(1280 800)
  mkdir -p "$shots"
  shots=$(realpath "$shots")
fi
export BLENDER_USER_RESOURCES=$PWD/build/profile-$name PYTHONDONTWRITEBYTECODE=1 PYTHONUNBUFFERED=1
export LIBGL_ALWAYS_SOFTWARE=1 LP_NUM_THREADS=0 FLIPFREE_BLENDER=$blender
timeout 900 xvfb-run -a -s "-screen 0 1280x800x24" "$blender" -p 0 0 "${size[@]}" --enable-event-simulate \
  --python tests/blender/window/session.py -- "$report" ${shots:+"$shots"} "${@:4}"
