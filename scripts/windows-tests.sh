#!/bin/bash
# Tests of the zips that scripts/cross.sh windows has made, under Wine; the last line says "N passed, N failed, N skipped".
#
#   scripts/windows-tests.sh [pytest arguments]          quick: the package and its processes in Windows' Python 3.11
#   scripts/windows-tests.sh --python [arguments]        all of tests/python
#   scripts/windows-tests.sh --blender [arguments]       in bpy 4.2, into which Blender installs the zip: tests/blender of
#                                                        processes, Check and Unwrap, or the files given
#   scripts/windows-tests.sh --sessions [FIRST LAST]     in the same bpy, sessions of 40 random calls (tests/blender/window/soak.py)
#                                                        with these seeds, 1 to 20 by default
#   scripts/windows-tests.sh --run FILE [arguments]      runs FILE in Windows' Python: tests/fuzz/random_calls.py --calls 40, say
#   scripts/windows-tests.sh --beside FILE [arguments]   and before that here, with the zip for Linux; {} is linux and windows:
#                                                        benchmarks/same_results.py write build/reports/bits-{}.json
#
# FLIPFREE_WINDOWS_PYTHON=3.13: in that Python. Without Wine or zip that is a skipped test.
# Wine's own files lie in build/windows/wine.
set -uo pipefail
cd "$(dirname "$0")/.."
windows=build/windows
there=Z:$PWD  # as Wine names it
version=${FLIPFREE_WINDOWS_PYTHON:-3.11}
zip=$(find dist -maxdepth 1 -name "*-windows_x64-py${version/./}.zip" | sort -V | tail -1)
part=quick
case "${1:-}" in --python | --blender | --sessions | --run | --beside) part=${1#--} && shift ;; esac
suite=windows-$part
[ $version = 3.11 ] || suite+=-$version
report=build/reports/$suite.xml
mkdir -p build/reports
if ! command -v wine > /dev/null || [ -z "$zip" ]; then
  echo '<testsuite><testcase name="windows"><skipped message="no Wine, or no zip: scripts/cross.sh windows"/></testcase></testsuite>' > "$report"
  exec build/venv/bin/python scripts/totals.py build/reports "$suite"
fi

site=$windows/site-$version packages=("numpy==$([ $version = 3.11 ] && echo 1.26.4 || echo 2.1.0)" pytest)  # Blender 4.2's; later ones want a newer Wine than 8
bpy=
case $part in blender | sessions) bpy=yes site=$windows/site-bpy packages+=(bpy==4.2.0) ;; esac
if [ ! -e "$site/.complete" ]; then
  rm -rf "$site"
  # Without what they need: bpy's own list has packages that its extensions alone use.
  build/venv/bin/python -m pip install -q --disable-pip-version-check --no-compile --target "$site" --platform win_amd64 \
    --python-version $version --only-binary=:all: --no-deps "${packages[@]}" iniconfig pluggy packaging pygments colorama 2> "$windows/log" ||
    { cat "$windows/log" >&2; exit 1; }
  touch "$site/.complete"
fi
rm -f $windows/python-$version/*._pth  # which would hide every other folder
package=$windows/package-$suite
unpack() {  # unpack ZIP FOLDER: the package in it
  rm -rf "$2" && mkdir -p "$2"
  unzip -qo "$1" 'wheels/*' -d "$2" && unzip -qo "$2"/wheels/*.whl -d "$2"
}
[ -n "$bpy" ] || unpack "$zip" "$package"
if [ $part = beside ]; then
  unpack "${zip/windows_x64/linux_x64}" "$package-linux"
  PYTHONPATH=$package-linux:tests:tests/python:tests/fuzz:benchmarks build/venv/bin/python "${@//\{\}/linux}"
  part=run
  set -- "${@//\{\}/windows}"
fi

export WINEPREFIX=$PWD/$windows/wine WINEDEBUG=-all WINEDLLOVERRIDES="mscoree,mshtml=;winedbg.exe=d" PYTHONDONTWRITEBYTECODE=1
export PYTHONPATH="$there/$package;$there/$site;$there/tests;$there/tests/python;$there/tests/fuzz;$there/benchmarks"
[ -z "${FLIPFREE_DATA:-}" ] || export FLIPFREE_DATA=Z:$FLIPFREE_DATA
# It prints to pipes alone; the desktop that Wine starts would hold one open that is waited for.
python() { timeout 1800 wine $windows/python-$version/python.exe "$@" < /dev/null > >(cat) 2>&1; }
[ -d "$WINEPREFIX" ] || wine wineboot -i > /dev/null 2>&1 < /dev/null

[ $part != run ] || { python "$@"; exit; }

if [ -n "$bpy" ]; then
  export BLENDER_USER_RESOURCES=$there/build/profile-$suite
  rm -rf "build/profile-$suite" && mkdir -p "build/profile-$suite"
  python scripts/farm/flipfree_bpy.py --install "$there/$zip"
fi
common=(-q -p no:cacheprovider --junitxml "$report" -o junit_suite_name="$suite")
rm -f "$report"
case $part in
  quick) python -m pytest "${common[@]}" tests/python/test_{process,unwrap,mesh_files}.py "$@" ;;
  python) python -m pytest "${common[@]}" "$@" ;;
  blender)
    [ $# -gt 0 ] || set -- tests/blender/test_{processes,check,unwrap}.py
    python tests/blender/run_bpy.py "${common[@]}" --rootdir tests/blender "$@"
    ;;
  sessions)
    cases=
    for seed in $(seq "${1:-1}" "${2:-20}"); do
      log=${report%.xml}-$seed.log
      rm -f "$log"
      python tests/blender/window/soak.py -- "$log" "$seed" 40 > "$log.said"
      cases+="<testcase name='$seed'>$(tail -1 "$log" | grep -q ^OK || echo '<failure/>')</testcase>"
    done
    echo "<testsuite>$cases</testsuite>" > "$report"
    ;;
esac
build/venv/bin/python scripts/totals.py build/reports "$suite"
