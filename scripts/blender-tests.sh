#!/bin/bash
# Installs the extension from its zip into a fresh profile of one Blender and runs tests/blender there.
#
#   scripts/blender-tests.sh BLENDER NAME [pytest arguments]
#
# NAME names the profile and the report: build/profile-NAME, build/reports/NAME.xml. Wants scripts/package.sh to have run.
set -euo pipefail
cd "$(dirname "$0")/.."
blender=$(realpath -s "${1:?usage: blender-tests.sh BLENDER NAME}")
name=${2:?usage: blender-tests.sh BLENDER NAME}
shift 2

# pytest for Blender's Python; it is pure Python, so one folder serves all.
if [ ! -e build/blender-pytest/.complete ]; then
  rm -rf build/blender-pytest
  build/venv/bin/python -m pip install --quiet --disable-pip-version-check --target build/blender-pytest pytest \
    2> build/pytest-install.log || { cat build/pytest-install.log >&2; exit 1; }
  touch build/blender-pytest/.complete
fi

export BLENDER_USER_RESOURCES=$PWD/build/profile-$name
export FLIPFREE_BLENDER=$blender PYTHONDONTWRITEBYTECODE=1
rm -rf "$BLENDER_USER_RESOURCES"
mkdir -p "$BLENDER_USER_RESOURCES" build/reports

tag=$("$blender" -b --factory-startup --python-expr 'import sys; print("TAG%d%d" % sys.version_info[:2])' 2>/dev/null | sed -n 's/^TAG//p')
zip=$(find dist -maxdepth 1 -name "*-linux_*-py$tag.zip" | sort -V | tail -1)
[ -n "$zip" ] || { echo "No zip for Python tag $tag in dist/: run scripts/package.sh" >&2; exit 1; }
"$blender" --command extension install-file -r user_default --enable "$zip" > "build/install-$name.log" 2>&1 || {
  cat "build/install-$name.log" >&2
  exit 1
}
"$blender" -b --python-exit-code 1 --python tests/blender/run.py -- build/blender-pytest tests/blender \
  -q -p no:cacheprovider --rootdir tests/blender --junitxml "build/reports/$name.xml" -o junit_suite_name="$name" "$@"
