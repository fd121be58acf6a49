#!/usr/bin/env bash
# clang-tidy (.clang-tidy) over C++ sources; any finding fails. Needs clang-tidy and a configured build/.
#   scripts/tidy.sh [FILE.cpp ...]      default: what differs from the last commit on main
set -euo pipefail
cd "$(dirname "$0")/.."
files=("$@")
[ $# -gt 0 ] || mapfile -t files < <(git diff --name-only --diff-filter=d main -- 'native/flipfree/*.cpp')
[ ${#files[@]} -gt 0 ] || { echo "No C++ source differs."; exit 0; }
printf '%s\n' "${files[@]}" | xargs -n 1 -P "$(nproc)" clang-tidy -p build --quiet --warnings-as-errors='*'
