#!/usr/bin/env bash
# Branch coverage of the rooms that decide whether a map is valid - base, numeric, mesh, certify - by their native tests and
# the replayed fuzz corpora: a table per file and room, and every line of certify/ with a branch that was not taken.
#   scripts/coverage.sh [FOLDER]      also writes an HTML report into FOLDER
# Branches that the compiler makes for exceptions are left out. Needs what scripts/setup.sh --tests installs; gcovr comes from PyPI.
set -euo pipefail
cd "$(dirname "$0")/.."
folder=build/coverage
python=$PWD/build/venv/bin/python
"$python" -c 'import gcovr' 2>/dev/null || "$python" -m pip install --quiet --disable-pip-version-check 'gcovr>=8'
cmake -S . -B "$folder" -G Ninja -DCMAKE_BUILD_TYPE=Release -DFLIPFREE_COVERAGE=ON -DFLIPFREE_TESTS=ON -DFLIPFREE_PYTHON=OFF \
  >/dev/null
cmake --build "$folder" --target base_tests numeric_tests mesh_tests certify_tests fuzz_replay
find "$folder" -name '*.gcda' -delete
for room in base numeric mesh certify; do
  "$folder/tests/native/${room}_tests" --gtest_brief=1
done
# The judges of the fuzz targets reach these rooms too.
for target in validate certify; do
  "$folder/tests/fuzz/fuzz_replay" "$target" "tests/fuzz/corpus/$target" 500 | tail -1
done
report=("$python" -m gcovr --root . --object-directory "$folder" --exclude-throw-branches --exclude-unreachable-branches
  --merge-mode-functions=merge-use-line-0 --filter 'native/flipfree/(base|numeric|mesh|certify)/')
"${report[@]}" --txt-metric branch --json "$folder/coverage.json" "$folder" >"$folder/coverage.txt"
"$python" scripts/coverage_table.py "$folder/coverage.json"
if [ $# -gt 0 ]; then
  mkdir -p "$1"
  "${report[@]}" --html-nested "$1/index.html" "$folder" >/dev/null
fi
