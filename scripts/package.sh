#!/bin/bash
# Builds the extension: dist/flipfree_uv-VERSION-linux_x64-py3XX.zip, one per Python.
#
#   scripts/package.sh            Blender's own builds: 4.2 to 5.0 take py311, 5.1 and later py313;
#                                 Debian's 4.3 takes py313, its 5.2 py314
#
# The core library is compiled once, the thin module per Python: for the Python of build/venv, and for those whose headers came
# with scripts/setup-blender.sh (build/blender-*). One zip per Python because Blender 4.2 chooses wheels by platform only.
set -euo pipefail
cd "$(dirname "$0")/.."

bash scripts/setup.sh
python=$PWD/build/venv/bin/python
own=$("$python" -c 'import sys; print("3.%d" % sys.version_info[1])')

# Blenders lend their Python's headers, and the last one validates and builds the zips. The headers alone are linked into a
# folder of their own: beside them lie those of another C library. FLIPFREE_PACKAGE_FOR: only these trees' Pythons.
trees=${FLIPFREE_PACKAGE_FOR:-build/blender-4.3 build/blender-5.2}
[ -n "${FLIPFREE_PACKAGE_FOR:-}" ] || {
  bash scripts/setup-blender.sh trixie build/blender-4.3
  bash scripts/setup-blender.sh sid build/blender-5.2
}
pythons=()
for tree in $trees; do
  for headers in "$tree"/usr/include/python3.[0-9]*; do
    [ -d "$headers" ] || continue
    version=$(basename "$headers" | sed 's/python//')
    [ "$version" != "$own" ] || continue
    folder=$PWD/build/python-headers/$version
    triplet=$(basename "$(dirname "$(find -L "$tree"/usr/include -path "*-linux-gnu/python$version" -prune)")")
    mkdir -p "$folder/$triplet"
    ln -sfn "$(realpath "$headers")" "$folder/python$version"
    ln -sfn "$(realpath "$tree")/usr/include/$triplet/python$version" "$folder/$triplet/python$version"
    pythons+=("$version=$folder")
  done
done
list=$(IFS=';'; echo "${pythons[*]:-}")

targets=(flipfree_package)
[ -n "${FLIPFREE_PACKAGE_FOR:-}" ] || targets+=(_native)
for entry in "${pythons[@]}"; do targets+=("_native_cp${entry%%=*}"); done
targets=("${targets[@]//./}")
bash scripts/build.sh -DFLIPFREE_WHEEL_PYTHONS="$list" -- "${targets[@]}"

blender=${trees##* }/blender
platform=linux-$(uname -m | sed 's/x86_64/x64/; s/aarch64/arm64/')
[ -n "${FLIPFREE_PACKAGE_FOR:-}" ] ||
  bash scripts/zip.sh "$blender" $platform "cp${own/./}" build/python/flipfree/_native.cpython-"${own/./}"-*.so
for entry in "${pythons[@]}"; do
  tag=cp${entry%%=*}
  tag=${tag/./}
  bash scripts/zip.sh "$blender" $platform "$tag" build/wheel_modules/"$tag"/_native.*.so
done
