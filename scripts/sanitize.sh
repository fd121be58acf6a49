#!/usr/bin/env bash
# Builds the native tests with AddressSanitizer and UndefinedBehaviorSanitizer and runs them; also switches the
# solvers' own invariant checks on (FLIPFREE_DEBUG_CHECKS). Any finding fails the run.
#   scripts/sanitize.sh [TEST_PROGRAM ...]      default: every *_tests
set -euo pipefail
cd "$(dirname "$0")/.."
cmake -S . -B build/sanitize -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_FLAGS_RELEASE="-O1 -g1" \
  -DFLIPFREE_SANITIZE=ON -DFLIPFREE_PYTHON=OFF -DFLIPFREE_BENCHMARKS=OFF >/dev/null
if [ $# -gt 0 ]; then programs=("$@"); else
  mapfile -t programs < <(cd tests/native && for d in */; do ls "$d"*_test.cpp >/dev/null 2>&1 && echo "${d%/}_tests"; done)
fi
cmake --build build/sanitize --target "${programs[@]}"
export ASAN_OPTIONS=detect_leaks=1 UBSAN_OPTIONS=print_stacktrace=1
for program in "${programs[@]}"; do
  "build/sanitize/tests/native/$program" --gtest_brief=1
done
