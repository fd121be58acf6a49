#!/bin/bash
# Random calls in one window of Blender, on a virtual screen: operators, undo, modes, views; see tests/blender/window/soak.py.
#
#   scripts/soak.sh BLENDER NAME [SEED [CALLS]]
#
# Uses the profile that scripts/blender-tests.sh made for NAME. The log, seed in its first line, is build/reports/NAME-soak.log.
set -euo pipefail
cd "$(dirname "$0")/.."
blender=$(realpath -s "${1:?usage: soak.sh BLENDER NAME [SEED [CALLS]]}")
name=${2:?usage: soak.sh BLENDER NAME [SEED [CALLS]]}
seed=${3:-$RANDOM}
log=$PWD/build/reports/$name-soak.log
mkdir -p build/reports
export BLENDER_USER_RESOURCES=$PWD/build/profile-$name PYTHONDONTWRITEBYTECODE=1 LIBGL_ALWAYS_SOFTWARE=1
status=0
xvfb-run -a -s "-screen 0 1280x800x24" "$blender" -p 0 0 1280 800 --enable-event-simulate \
  --python tests/blender/window/soak.py -- "$log" "$seed" "${4:-300}" > "${log%.log}-output.log" 2>&1 || status=$?
tail -3 "$log"
exit $status
