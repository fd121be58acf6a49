#!/bin/bash
# The functions of C's mathematics whose last bits are each system's own, from one source for all (musl's, of Debian): as a static
# library, FOLDER/libflipfree_libm.a.
#
#   CC=... AR=... scripts/libm.sh FOLDER
set -euo pipefail
cd "$(dirname "$0")/.."
out=$(realpath -m "${1:?usage: libm.sh FOLDER}")
[ ! -e "$out/libflipfree_libm.a" ] || exit 0
. scripts/sources.sh
folder=$out/libm
mkdir -p "$folder"
sources musl/bookworm
unpack musl "$folder/source"

# Headers of the compiler's own and musl's for mathematics, none of the system's.
headers=$folder/headers
mkdir -p "$headers/bits"
cp "$folder"/source/include/{math,complex}.h "$headers"
echo 'typedef float float_t; typedef double double_t;' > "$headers/bits/alltypes.h"
printf '#define __%s\n' 'LITTLE_ENDIAN 1234' 'BIG_ENDIAN 4321' 'BYTE_ORDER 1234' | sed 's/^#define \(\w*\)/#undef \1\n&/' > "$headers/endian.h"
files=()
for name in complex/{cabs,carg} math/{acosh,asin,atan,atan2,cos,exp,exp2,expm1,hypot,log,log1p,log2,pow,sin,sincos,tan} \
  math/{atanl,atan2l,expl,hypotl,logl} math/__{cos,sin,tan,rem_pio2,rem_pio2_large,invtrigl,polevll,fpclassifyl} \
  math/__math_{divzero,invalid,oflow,uflow,xflow} math/{exp,log,log2,pow}_data; do
  files+=("source/src/$name.c")
done
# Without fused operations, which some processors have and others not.
(
  cd "$folder"
  quietly ${CC:-cc} -O2 -fPIC -w -std=c99 -D_GNU_SOURCE -ffreestanding -fbuiltin -ffp-contract=off -U__FP_FAST_FMA \
    -fvisibility=hidden -Iheaders -Isource/src/include -Isource/src/internal -Isource/arch/generic -c "${files[@]}"
)
${AR:-ar} rcs "$out/libflipfree_libm.a" "$folder"/*.o
