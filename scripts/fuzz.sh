#!/usr/bin/env bash
# Fuzzes the solver with libFuzzer, AddressSanitizer and UndefinedBehaviorSanitizer.
#   scripts/fuzz.sh [MINUTES [TARGET ...]]      default: 2 minutes on a processor for each target of tests/fuzz
# Committed inputs (tests/fuzz/corpus, text) are replayed first. What is learnt stays in build/fuzz-corpus/TARGET, so that later
# runs go on from there. At a finding the exit status is 1, and the input, made small, lies as text in build/fuzz-findings: move it to
# tests/fuzz/corpus/TARGET and it is a test (fuzz.TARGET). FLIPFREE_FUZZ_JOBS runs as many targets side by side (default: cores).
# Needs Clang 14 or newer with its runtime: on Debian and Ubuntu a missing one is installed.
set -euo pipefail
cd "$(dirname "$0")/.."
minutes=${1:-2}
[ $# -eq 0 ] || shift
targets=("$@")
[ ${#targets[@]} -gt 0 ] || mapfile -t targets < <(cd tests/fuzz && for f in fuzz_*.cpp; do f=${f#fuzz_}; echo "${f%.cpp}"; done)

find_clang() {  # the newest clang++ that can link a fuzzer
  local program
  for program in clang++ $(compgen -c | grep -E '^clang\+\+-[0-9]+$' | sort -t- -k2 -rn -u); do
    command -v "$program" >/dev/null || continue
    echo 'extern "C" int LLVMFuzzerTestOneInput(const unsigned char*, unsigned long) { return 0; }' |
      "$program" -x c++ -fsanitize=fuzzer,address,undefined -o /dev/null - 2>/dev/null && { echo "$program"; return; }
  done
  return 1
}
if ! clang=$(find_clang); then
  root=()
  [ "$(id -u)" = 0 ] || root=(sudo)
  for version in 19 18 17 16 15 14; do
    [ -n "$(apt-cache search --names-only "^libclang-rt-$version-dev\$")" ] || continue
    echo "Installing clang-$version"
    "${root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -q -o DPkg::Lock::Timeout=600 install -y --no-install-recommends \
      "clang-$version" "libclang-rt-$version-dev" "llvm-$version" >/dev/null
    break
  done
  clang=$(find_clang) || { echo "No Clang with libFuzzer was found: install clang and libclang-rt." >&2; exit 2; }
fi
symbolizer=$(command -v "llvm-symbolizer${clang#clang++}" || command -v llvm-symbolizer || true)
export ASAN_OPTIONS=detect_leaks=1:allocator_may_return_null=1${symbolizer:+:external_symbolizer_path=$symbolizer}
export UBSAN_OPTIONS=print_stacktrace=1${symbolizer:+:external_symbolizer_path=$symbolizer}

cmake -S . -B build/fuzz -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_C_COMPILER="${clang/++/}" -DCMAKE_CXX_COMPILER="$clang" \
  -DFLIPFREE_FUZZ=ON -DFLIPFREE_PYTHON=OFF >/dev/null
cmake --build build/fuzz --target "${targets[@]/#/fuzz_}"
mkdir -p build/fuzz-findings build/fuzz-logs

fuzz() {  # fuzz TARGET: replays, then fuzzes; says one line
  local target=$1 program=build/fuzz/tests/fuzz/fuzz_$1 corpus=build/fuzz-corpus/$1 log=build/fuzz-logs/$1.log
  local found=build/fuzz-findings/$1 status=0
  mkdir -p "$corpus" "$found"
  python3 scripts/fuzz_corpus.py to-binary "tests/fuzz/corpus/$target" "$corpus"
  # Minutes on a processor, however busy the machine: the fuzzer is told to stop (SIGUSR1) when it has had them.
  nice -n 15 "$program" "$corpus" -timeout=300 -rss_limit_mb=3000 -max_len=400 -handle_usr1=1 \
    -use_value_profile=1 -print_final_stats=1 -artifact_prefix="$found/" >"$log" 2>&1 &
  local fuzzer=$! used=0 now
  while sleep 2 && now=$(ps -o cputimes= -p "$fuzzer"); do
    used=$now
    [ "$used" -lt "$((minutes * 60))" ] || { kill -USR1 "$fuzzer" 2>/dev/null || true; break; }
  done
  wait "$fuzzer" || status=$?
  local runs seed
  runs=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log")
  seed=$(sed -n 's/^INFO: Seed: *//p' "$log")
  if [ "$status" = 0 ]; then
    echo "$target: $runs runs in $used seconds on a processor, seed $seed: no finding"
    return 0
  fi
  local input
  input=$(sed -n "s/^.*Test unit written to //p" "$log" | tail -1)
  grep -m 3 -E 'FINDING|ERROR|runtime error' "$log" || true
  if [ -z "$input" ]; then
    echo "$target: stopped with status $status, see $log"
    return 1
  fi
  # Smaller inputs are easier to read; a failure to make it so changes nothing.
  nice -n 15 "$program" "$input" -minimize_crash=1 -max_total_time=60 -exact_artifact_path="$input.small" >/dev/null 2>&1 || true
  [ -s "$input.small" ] || cp "$input" "$input.small"
  python3 scripts/fuzz_corpus.py to-text "$input.small" "$input.txt"
  echo "$target: FINDING after $runs runs, seed $seed: $input.txt (log: $log)"
  return 1
}
export -f fuzz
export minutes
printf '%s\n' "${targets[@]}" |
  xargs -P "${FLIPFREE_FUZZ_JOBS:-$(nproc)}" -I{} bash -c 'fuzz "$1" || exit 1' _ {} || exit 1
