#!/bin/bash
# Makes a release in dist/release-VERSION: what users of Blender's own builds take, as a static extension repository.
#
#   scripts/release.sh [--linux]     --linux: without the zips for Windows and macOS (scripts/cross.sh)
#
#   flipfree_uv-VERSION-PLATFORM-py3XX.zip   validated; each says which Blenders it is for
#   index.json                               the repository: its address, added in Blender's preferences, brings updates
#   debian/                                  zips for Debian's own Blenders, not in the repository
#   SHA256SUMS, NOTES.md                     of all zips; this version's part of CHANGELOG.md
set -euo pipefail
cd "$(dirname "$0")/.."
version=$(sed -n 's/^project(flipfree VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)
out=$PWD/dist/release-$version
blender=$PWD/build/blender-5.2/blender
export BLENDER_USER_RESOURCES=$PWD/build/package-profile

notes=$(sed -n "/^## $version\$/,/^## /{/^## /d;p}" CHANGELOG.md)
[ -n "$notes" ] || { echo "CHANGELOG.md has nothing about $version." >&2; exit 1; }
rm -rf "$out" build/extension-*
bash scripts/package.sh
[ "${1:-}" = --linux ] || for target in windows macos; do bash scripts/cross.sh $target; done

mkdir -p "$out/debian"
cp dist/flipfree_uv-"$version"-linux_*-py31[34].zip "$out/debian"
for stage in build/extension-*-cp31[13]; do
  platform=$(sed 's/.*extension-\(.*\)-cp.*/\1/; s/-/_/' <<< "$stage")
  # A repository offers one zip per platform and Blender. Those with Python 3.13 before 5.1 are Debian's.
  range='blender_version_min = "5.1.0"'
  [ "${stage##*-}" = cp313 ] || range='blender_version_min = "4.2.0"\nblender_version_max = "5.1.0"'
  sed -i "s/^blender_version_min = .*/$range/" "$stage/blender_manifest.toml"
  "$blender" --command extension build --source-dir "$stage" --output-filepath "$out/flipfree_uv-$version-$platform-py${stage##*-cp}.zip"
done
for zip in "$out"/*.zip "$out"/debian/*.zip; do "$blender" --command extension validate "$zip"; done
"$blender" --command extension server-generate --repo-dir="$out"
echo "$notes" > "$out/NOTES.md"
(cd "$out" && sha256sum ./*.zip debian/*.zip > SHA256SUMS && cat SHA256SUMS)
