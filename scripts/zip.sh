#!/bin/bash
# Packs one zip of the extension: dist/flipfree_uv-VERSION-PLATFORM-py3XX.zip, with an underscore in PLATFORM.
#
#   scripts/zip.sh BLENDER PLATFORM TAG MODULE
#
# BLENDER validates and builds it; PLATFORM as manifests have it, linux-x64, windows-x64; TAG of the Python, cp311; MODULE, the
# compiled solver for both.
set -euo pipefail
cd "$(dirname "$0")/.."
blender=$1 platform=$2 tag=$3 module=$4
version=$(sed -n 's/^project(flipfree VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)
stage=build/extension-$platform-$tag
log=$stage.log
export BLENDER_USER_RESOURCES=$PWD/build/package-profile

rm -rf "$stage"
mkdir -p dist "$stage/wheels"
cp -r addon/. blender_manifest.toml LICENSE "$stage/"
find "$stage" -name __pycache__ -prune -exec rm -rf {} +
wheel=$(build/venv/bin/python scripts/make_wheel.py --module "$module" --package native/python/flipfree \
  --python "$tag" --version "$version" --out "$stage/wheels")
sed -i "s/^version = .*/version = \"$version\"/; s/^platforms = .*/platforms = [\"$platform\"]/" "$stage/blender_manifest.toml"
printf 'wheels = ["./wheels/%s"]\n' "$(basename "$wheel")" >> "$stage/blender_manifest.toml"
zip=$PWD/dist/flipfree_uv-$version-${platform/-/_}-py${tag#cp}.zip
{ "$blender" --command extension validate "$stage" &&
  "$blender" --command extension build --source-dir "$stage" --output-filepath "$zip"; } > "$log" 2>&1 || {
  cat "$log" >&2
  exit 1
}
echo "$zip ($(du -k "$zip" | cut -f1) kB)"
