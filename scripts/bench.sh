#!/bin/bash
# Builds the Google Benchmark programs of benchmarks/ into build/benchmarks and runs those that are named:
#
#   scripts/bench.sh [PROGRAM [--benchmark_filter=... ...]]
set -euo pipefail
cd "$(dirname "$0")/.."
bash scripts/setup.sh --tests
bash scripts/build.sh -DFLIPFREE_BENCHMARKS=ON -- benchmarks/all
[ $# -eq 0 ] || exec "build/benchmarks/$1" "${@:2}"
