# What is read by scripts that build libraries from Debian's sources: . scripts/sources.sh, in the project's folder. $folder is where
# logs go.
downloads=$PWD/build/downloads

quietly() {  # shows what a command said if it fails
  "$@" > "$folder/log" 2>&1 || { tail -30 "$folder/log" >&2; exit 1; }
}

# Sources as their authors published them, without Debian's patches. GMP before 6.3 uses a register that is macOS's own.
source_hashes="bd2966e6d277f79328e894a5a9f3ba3fbf2ed2be81def5f48623e30c23fb1572  gmp_6.3.0+dfsg.orig.tar.xz
06a378df13501248c1b2db5aa977a2c8126ae849a9d9b7be2546fb4a9c26d993  mpfr4_4.2.0.orig.tar.xz
4df84295f5cca86b1ae8bfee8ff4db5efb6850e4e5b571ad0199147176dea796  openmesh_9.0.orig.tar.gz
2411c74bda5bbcfcddaf4531f66d1adc73f247f529aee981b029513aefdbf849  python3.11_3.11.2.orig.tar.gz
93e583f243454e6e9e4588ca2c2662206ad961659863277afcdb96801647d640  python3.13_3.13.5.orig.tar.xz
7d5b0b6062521e4627e099e4c9dc8248d32a30285e959b7eecaa780cf8cfd4a4  musl_1.2.3.orig.tar.gz"

sources() {  # sources PACKAGE/SUITE ...: into build/downloads
  local state=$downloads/apt hashes mirror
  hashes=$(for name in "$@"; do grep "  ${name%/*}_" <<< "$source_hashes"; done)
  mkdir -p "$downloads"
  ! (cd "$downloads" && sha256sum --status -c <<< "$hashes" 2> /dev/null) || return 0
  mirror=${DEBIAN_MIRROR:-$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Origin: Debian' |
    grep -v security | sort | uniq -c | sort -rn | awk 'NR == 1 {print $2}')}
  mkdir -p "$state/lists/partial" "$state/cache/archives/partial"
  printf "deb-src [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] $mirror %s main\n" bookworm trixie > "$state/sources.list"
  local options=(-q -o "Dir::Etc::sourcelist=$state/sources.list" -o Dir::Etc::sourceparts=/dev/null
    -o "Dir::State=$state" -o "Dir::Cache=$state/cache" -o APT::Sandbox::User=root)
  quietly apt-get "${options[@]}" update
  (
    cd "$downloads"
    quietly apt-get "${options[@]}" source --download-only "$@"
    quietly sha256sum -c <<< "$hashes"
  )
}

unpack() {  # unpack SOURCE FOLDER
  rm -rf "$2" && mkdir -p "$2"
  tar xf "$downloads/$(sed -n "s/.*  \($1_.*\)/\1/p" <<< "$source_hashes")" -C "$2" --strip-components 1
}
