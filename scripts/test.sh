#!/bin/bash
# Sets up, builds and runs the tests; the last line says "N passed, N failed, N skipped".
#
#   scripts/test.sh                   everything, long protocols by a sample: what .ci/run calls
#   scripts/test.sh --long            everything, long protocols whole
#   scripts/test.sh --quick [STAGE]   after an edit: native and Python tests that took under a second each in the last whole run
#                                     (all, if there was none), or a stage's alone
#
# C++ (GoogleTest), the Python package (pytest), the extension inside Blender 4.3 and 5.2, without and with a window, and the checks
# of style. Skipped tests say what is missing. FLIPFREE_DATA names the shared data folder, if it is there; FLIPFREE_SEED the sample
# (tests/sampling.py), which is the commit's otherwise.
set -uo pipefail
cd "$(dirname "$0")/.."
source scripts/steps.sh
export FLIPFREE_DATA=${FLIPFREE_DATA:-$PWD/../shared/data}
export FLIPFREE_SEED=${FLIPFREE_SEED:-$((0x$(git rev-parse --short=6 HEAD 2>/dev/null || echo 1)))}
# Modules are compiled once, not by each of the hundreds of processes that tests start.
export PYTHONPYCACHEPREFIX=$PWD/build/pycache
unset PYTHONDONTWRITEBYTECODE
reports=build/reports

give_up() {
  echo "$1"
  echo "0 passed, 1 failed, 0 skipped"
  exit 1
}
native() { ctest --test-dir build --output-on-failure --quiet -j "$(nproc)" --output-junit "$PWD/$reports/native.xml" "$@"; }
python() {  # one more process than cores, as some wait
  PYTHONPATH=build/python build/venv/bin/python -m pytest -q -n "$(($(nproc) + 1))" --dist worksteal --junitxml "$reports/python.xml" "$@"
}
totals() { build/venv/bin/python scripts/totals.py "$reports" "$@"; }

if [ "${1:-}" = --quick ]; then
  stage=${2:-}
  mkdir -p "$reports" build/slow
  touch build/slow/{native,python}.txt
  rm -f "$reports"/{native,python}.xml
  bash scripts/setup.sh --tests || give_up "The set-up failed: see above."
  if [ -n "$stage" ]; then
    step build bash scripts/build.sh -DFLIPFREE_TESTS=ON -- "${stage}_tests" || give_up "The build failed: see above."
    step "C++, $stage" "build/tests/native/${stage}_tests" --gtest_brief=1 --gtest_output="xml:$reports/native.xml" \
      --gtest_filter="-$(paste -sd: build/slow/native.txt)"
    totals native
    exit
  fi
  step build bash scripts/build.sh -DFLIPFREE_TESTS=ON || give_up "The build failed: see above."
  step "C++" native -E "^($(paste -sd'|' build/slow/native.txt))\$"
  mapfile -t slow < build/slow/python.txt
  step "Python" python "${slow[@]/#/--deselect=}"
  totals native python
  exit
fi
[ "${1:-}" != --long ] || export FLIPFREE_LONG=1
echo "FLIPFREE_SEED=$FLIPFREE_SEED chooses the sample of long protocols${FLIPFREE_LONG:+; all of them run}."

step "set-up" bash scripts/setup.sh --tests || give_up "The set-up failed: see above."
rm -rf "$reports"
mkdir -p "$reports"
# Blenders are fetched while the compiler works.
{ bash scripts/setup-blender.sh trixie build/blender-4.3 && bash scripts/setup-blender.sh sid build/blender-5.2; } \
  > build/setup-blender.log 2>&1 &
step "build" bash scripts/build.sh -DFLIPFREE_TESTS=ON || give_up "The build failed: see above."
step "C++" native
step "Python" python
build/venv/bin/python scripts/totals.py "$reports" --slow build/slow
wait
cat build/setup-blender.log

in_blender() {  # in_blender VERSION: without and with a window
  step "Blender $1" bash scripts/blender-tests.sh "build/blender-$1/blender" "blender-$1"
  step "Blender $1, window" bash scripts/window-tests.sh "build/blender-$1/blender" "blender-$1"
}
if step "package" bash scripts/package.sh; then
  in_blender 5.2 > build/blender-5.2.log 2>&1 &
  in_blender 4.3
  wait
  cat build/blender-5.2.log
fi
step "Windows" bash scripts/windows-tests.sh
step "style" build/venv/bin/python scripts/check_style.py "$reports/style.xml"
step "weight" build/venv/bin/python scripts/weight.py
totals native python blender-4.3 blender-5.2 blender-4.3-window blender-5.2-window windows-quick style
