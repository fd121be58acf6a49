#!/bin/bash
# Gets a Blender to build and test against, without root and without touching the system:
#
#   scripts/setup-blender.sh SUITE DIR     e.g.  scripts/setup-blender.sh trixie build/blender-4.3
#
# SUITE is a Debian suite: trixie has Blender 4.3.2 (Python 3.13), sid has 5.2 LTS (Python 3.14). The suite's blender,
# the packages it needs down to libc, and the headers of its Python (for compiling the wheel) are unpacked into
# DIR with apt's downloader and dpkg-deb alone; nothing is installed or configured. DIR/blender starts it with DIR's own
# dynamic loader and libraries, so it runs on any Linux of the same architecture, and DIR may be moved.
#
# A finished DIR is recognised by its stamp and left as it is. The mirror is the one that this machine's apt uses;
# DEBIAN_MIRROR overrides it (needed where apt's mirror is not Debian's, as on Ubuntu).
set -euo pipefail

suite=${1:?usage: setup-blender.sh SUITE DIR}
tree=$(realpath -m "${2:?usage: setup-blender.sh SUITE DIR}")
stamp="$suite-layout-1"

if [ -f "$tree/.complete" ] && [ "$(cat "$tree/.complete")" = "$stamp" ]; then
  exit 0
fi

for tool in apt-get dpkg-deb; do
  command -v "$tool" >/dev/null || {
    echo "setup-blender.sh needs $tool (Debian or Ubuntu). Elsewhere: install the extension into" \
         "a Blender of your own." >&2
    exit 1
  }
done

mirror=${DEBIAN_MIRROR:-$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Origin: Debian' |
  grep -v security | sort | uniq -c | sort -rn | awk 'NR == 1 {print $2}')}
keyring=${DEBIAN_KEYRING:-/usr/share/keyrings/debian-archive-keyring.gpg}
[ -n "$mirror" ] || { echo "No Debian mirror in apt's configuration: set DEBIAN_MIRROR to one." >&2; exit 1; }
[ -f "$keyring" ] || { echo "Install debian-archive-keyring, or set DEBIAN_KEYRING to its file." >&2; exit 1; }

# numpy is no dependency of Debian's Blender; cattr and requests make its extension manager work; the GL
# libraries draw windows in software; libpython3-dev has the headers.
packages=(blender python3-numpy python3-cattr python3-requests libgl1 libglx-mesa0 libegl1 libgl1-mesa-dri libpython3-dev)

# --- an apt that knows nothing of this machine, so that it resolves the whole closure ---------------------------------
rm -rf "$tree"
state=$tree/.apt
mkdir -p "$state"/{etc/apt.conf.d,etc/preferences.d,lists/partial,archives/partial}
: > "$state/status"
echo "deb [signed-by=$keyring] $mirror $suite main" > "$state/etc/sources.list"
# The machine's own proxies and certificates stay in force.
apt-config dump | grep -E '^Acquire::(https?|ftp)::' > "$state/apt.conf" || true
cat >> "$state/apt.conf" <<CONF
Dir::Etc "$state/etc";
Dir::State "$state";
Dir::State::lists "$state/lists";
Dir::State::status "$state/status";
Dir::Cache "$state";
Dir::Cache::archives "$state/archives";
APT::Architecture "amd64";
APT::Architectures { "amd64"; };
APT::Install-Recommends "false";
APT::Sandbox::User "root";
Acquire::Languages "none";
Acquire::Check-Valid-Until "false";
Acquire::Queue-Mode "access";
Acquire::Retries "3";
Debug::NoLocking "true";
CONF
export APT_CONFIG=$state/apt.conf

fetch() {  # runs a command quietly; shows what it said if it fails
  "$@" > "$state/log" 2>&1 || { tail -20 "$state/log" >&2; exit 1; }
}
echo "Fetching Blender of Debian $suite and all it needs ..."
fetch apt-get -q update
fetch apt-get -q -y --download-only install "${packages[@]}"

# --- unpack ---------------------------------------------------------------------------------------------------
for directory in bin sbin lib lib64; do
  mkdir -p "$tree/usr/$directory"
  ln -sfn "usr/$directory" "$tree/$directory"
done
unpack() {
  for package in "$@"; do
    dpkg-deb --fsys-tarfile "$package" | tar -x -C "$tree" --keep-directory-symlink --no-same-owner \
      --exclude=./usr/share/doc --exclude=./usr/share/man --exclude=./usr/share/locale --exclude=./usr/share/info
  done
}
export -f unpack
export tree
find "$state/archives" -maxdepth 1 -name '*.deb' ! -name 'base-files_*' -print0 |
  xargs -0 -P "$(nproc)" -n 8 bash -c 'set -euo pipefail; unpack "$@"' unpack

# --- launchers --------------------------------------------------------------------------------------------------
# blas/ and lapack/ hold what update-alternatives would have linked. Every launcher finds the tree from its own place.
loader='lib=$tree/usr/lib/x86_64-linux-gnu
libraries=$lib:$tree/usr/lib:$lib/blas:$lib/lapack:$lib/pulseaudio'
python=$(basename "$(find "$tree/usr/lib" -maxdepth 1 -name 'python3.[0-9]*' | sort -V | tail -1)")

mv "$tree/usr/bin/$python" "$tree/usr/bin/$python.real"
cat > "$tree/usr/bin/$python" <<LAUNCHER
#!/bin/sh
tree=\$(cd "\$(dirname "\$(readlink -f "\$0")")/../.." && pwd)
$loader
exec "\$lib/ld-linux-x86-64.so.2" --argv0 "\$tree/usr/bin/$python" --library-path "\$libraries" "\$tree/usr/bin/$python.real" "\$@"
LAUNCHER
cat > "$tree/blender" <<LAUNCHER
#!/bin/sh
tree=\$(cd "\$(dirname "\$(readlink -f "\$0")")" && pwd)
$loader
export BLENDER_SYSTEM_RESOURCES="\$tree/usr/share/blender" BLENDER_SYSTEM_PYTHON="\$tree/usr"
export LIBGL_DRIVERS_PATH="\$lib/dri" __EGL_VENDOR_LIBRARY_DIRS="\$tree/usr/share/glvnd/egl_vendor.d"
exec "\$lib/ld-linux-x86-64.so.2" --argv0 "\$tree/blender" --library-path "\$libraries" "\$tree/usr/bin/blender" "\$@"
LAUNCHER
chmod +x "$tree/usr/bin/$python" "$tree/blender"

rm -rf "$state"
version=$("$tree/blender" --version | head -1)
echo "$stamp" > "$tree/.complete"
echo "$version with ${python^} in $tree, $(du -sm "$tree" | cut -f1) MB"
