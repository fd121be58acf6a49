#!/usr/bin/env bash
# Builds the native tests with sanitizers and runs them; also switches the solvers' own invariant checks on
# (FLIPFREE_DEBUG_CHECKS). Any finding fails the run.
#   scripts/sanitize.sh [--thread] [TEST_PROGRAM ...]      default: every *_tests
#   scripts/sanitize.sh --odr
# Without an option: AddressSanitizer and UndefinedBehaviorSanitizer. --thread: ThreadSanitizer. --odr: nothing is run; the library
# is linked with link-time optimisation, where types and functions of one name that differ between files (-Wodr) are errors.
set -euo pipefail
cd "$(dirname "$0")/.."
options=(-DCMAKE_BUILD_TYPE=Release -DFLIPFREE_TESTS=ON -DFLIPFREE_PYTHON=OFF)
if [ "${1:-}" = --odr ]; then
  cmake -S . -B build/odr -G Ninja "${options[@]}" -DCMAKE_CXX_FLAGS_RELEASE="-O1 -DNDEBUG" -DCMAKE_CXX_FLAGS="-flto=auto" \
    -DFLIPFREE_UNITY=OFF >/dev/null
  cmake --build build/odr --target flipfree_core
  # Whatever is undefined comes from the libraries that programs link.
  "${CXX:-g++}" -shared -o build/odr/all.so -flto=auto -O1 -Wodr -Wlto-type-mismatch -Werror \
    -Wl,--whole-archive build/odr/libflipfree_core.a -Wl,--no-whole-archive
  echo "No two types or functions of one name differ."
  exit
fi
sanitizers=address,undefined folder=build/sanitize
if [ "${1:-}" = --thread ]; then sanitizers=thread folder=build/sanitize-thread; shift; fi
cmake -S . -B "$folder" -G Ninja "${options[@]}" -DCMAKE_CXX_FLAGS_RELEASE="-O1 -g1" -DFLIPFREE_SANITIZE="$sanitizers" >/dev/null
if [ $# -gt 0 ]; then programs=("$@"); else
  mapfile -t programs < <(cd tests/native && for d in */; do [ -z "$(find "$d" -name '*_test.cpp')" ] || echo "${d%/}_tests"; done)
fi
cmake --build "$folder" --target "${programs[@]}"
# CHOLMOD, which tests compare with, has threads of its own that ThreadSanitizer does not see the locks of.
printf 'race:%s\n' libcholmod libsuitesparseconfig libgomp >build/tsan-suppressions
export ASAN_OPTIONS=detect_leaks=1 UBSAN_OPTIONS=print_stacktrace=1
# A test forks: the child goes on with threads of its own.
export TSAN_OPTIONS=halt_on_error=1:die_after_fork=0:suppressions=$PWD/build/tsan-suppressions
# Where memory fails on purpose, CGAL's containers lose the block that they were about to use; nothing of ours does.
suppressions=$PWD/build/lsan-suppressions
echo 'leak:CGAL::Compact_container' >"$suppressions"
failed=()
for program in "${programs[@]}"; do
  options=()
  [ "$program" != faults_tests ] || options=("LSAN_OPTIONS=suppressions=$suppressions:print_suppressions=0")
  env "${options[@]}" "$folder/tests/native/$program" --gtest_brief=1 || failed+=("$program")
done
[ ${#failed[@]} -eq 0 ] || { echo "Findings in: ${failed[*]}" >&2; exit 1; }
