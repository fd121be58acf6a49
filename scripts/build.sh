#!/bin/bash
# Configures and builds into build/. Options for CMake come first, targets after --:
#
#   scripts/build.sh [-DNAME=VALUE ...] [-- TARGET ...]
#
# Says every tenth of the way how far it is.
set -euo pipefail
cd "$(dirname "$0")/.."

options=()
while [ $# -gt 0 ] && [ "$1" != -- ]; do
  options+=("$1")
  shift
done
[ $# -eq 0 ] || shift

# Clang takes three quarters of GCC's time, most of it saved in the tests' templates, and gives the same maps to the bit.
if [ -z "${CXX:-}" ] && command -v clang++ >/dev/null; then
  export CC=clang CXX=clang++
fi
log=build/configure.log
cmake -S . -B build -G Ninja -DCMAKE_BUILD_TYPE=Release -DPython_EXECUTABLE="$PWD/build/venv/bin/python" "${options[@]}" \
  > "$log" 2>&1 || { cat "$log" >&2; exit 1; }
# What is no line of progress is what a compiler says. Ninja would keep its lines back in a pipe.
NINJA_STATUS='at %p ' stdbuf -oL ninja -C build "$@" | awk '
  /^ninja: (no work|Entering)/ { next }
  /^at +[0-9]+%/ { tenth = int($2 / 10); if (tenth > shown) { shown = tenth; print "   " 10 * tenth " %"; fflush() } next }
  { print; fflush() }'
