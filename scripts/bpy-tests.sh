#!/bin/bash
# Blender's own builds as the packages bpy: installs the extension's zip in each and runs tests/blender there.
#
#   scripts/bpy-tests.sh [VERSION ...] [-- pytest arguments]       4.2.0 4.5 5.0 by default; those that have Python 3.11
#
# Wants a Python 3.11 (PYTHON), pip's access to the packages, and scripts/package.sh to have run.
set -euo pipefail
cd "$(dirname "$0")/.."
python=${PYTHON:-python3.11}
versions=()
while [ $# -gt 0 ] && [ "$1" != -- ]; do
  versions+=("$1")
  shift
done
[ $# -eq 0 ] || shift
[ ${#versions[@]} -gt 0 ] || versions=(4.2.0 4.5 5.0)

zip=$(find dist -maxdepth 1 -name "*-linux_*-py311.zip" | sort -V | tail -1)
[ -n "$zip" ] || { echo "No zip for Python 3.11 in dist/: run scripts/package.sh" >&2; exit 1; }
mkdir -p build/reports
for version in "${versions[@]}"; do
  name=bpy-$version
  venv=build/$name
  if [ ! -e "$venv/.complete" ]; then
    rm -rf "$venv"
    "$python" -m venv "$venv"
    "$venv/bin/python" -m pip install --quiet --disable-pip-version-check "bpy==$version.*" numpy pytest 2> "build/$name.log" ||
      { cat "build/$name.log" >&2; exit 1; }
    touch "$venv/.complete"
  fi
  export BLENDER_USER_RESOURCES=$PWD/build/profile-$name PYTHONDONTWRITEBYTECODE=1
  rm -rf "$BLENDER_USER_RESOURCES"
  mkdir -p "$BLENDER_USER_RESOURCES"
  "$venv/bin/python" scripts/farm/flipfree_bpy.py --install "$zip" > "build/install-$name.log" 2>&1 ||
    { cat "build/install-$name.log" >&2; exit 1; }

  "$venv/bin/python" tests/blender/run_bpy.py tests/blender -q -p no:cacheprovider \
    --rootdir tests/blender --junitxml "build/reports/$name.xml" -o junit_suite_name="$name" "$@"
done
