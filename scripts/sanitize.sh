#!/usr/bin/env bash
# Builds the native tests with sanitizers and runs them; also switches the solvers' own invariant checks on
# (FLIPFREE_DEBUG_CHECKS). Any finding fails the run.
#   scripts/sanitize.sh [--thread] [TEST_PROGRAM ...]      default: every *_tests
# Without --thread: AddressSanitizer and UndefinedBehaviorSanitizer. With it: ThreadSanitizer.
set -euo pipefail
cd "$(dirname "$0")/.."
sanitizers=address,undefined folder=build/sanitize
if [ "${1:-}" = --thread ]; then sanitizers=thread folder=build/sanitize-thread; shift; fi
cmake -S . -B "$folder" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_FLAGS_RELEASE="-O1 -g1" \
  -DFLIPFREE_SANITIZE="$sanitizers" -DFLIPFREE_PYTHON=OFF -DFLIPFREE_BENCHMARKS=OFF >/dev/null
if [ $# -gt 0 ]; then programs=("$@"); else
  mapfile -t programs < <(cd tests/native && for d in */; do [ -z "$(find "$d" -name '*_test.cpp')" ] || echo "${d%/}_tests"; done)
fi
cmake --build "$folder" --target "${programs[@]}"
export ASAN_OPTIONS=detect_leaks=1 UBSAN_OPTIONS=print_stacktrace=1 TSAN_OPTIONS=halt_on_error=1
for program in "${programs[@]}"; do
  "$folder/tests/native/$program" --gtest_brief=1
done
