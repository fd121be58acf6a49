#!/bin/bash
# Makes the pictures of Blender's window in docs/images that are cut out of the tests with a window, anew: result, check, improve, menu, panel,
# live_pins.gif.
#
#   scripts/docs-pictures.sh BLENDER NAME
#
# As scripts/window-tests.sh, whose profile it uses; wants ImageMagick. BLENDER: 5.2, whose UV editor shows the map also
# where it is not selected. Look at the pictures before committing.
set -euo pipefail
cd "$(dirname "$0")/.."
shots=$(mktemp -d)
trap 'rm -rf "$shots"' EXIT
bash scripts/window-tests.sh "${1:?usage: docs-pictures.sh BLENDER NAME}" "${2:?usage: docs-pictures.sh BLENDER NAME}" "$shots" \
  menus_draw check_selects sidebars follow_a_transform
small=(-strip -dither None -colors 256 -define png:compression-level=9)
convert "$shots/panel_unwrapped.png" "${small[@]}" docs/images/panel.png
convert "$shots/menu.png" -crop 410x378+540+250 +repage "${small[@]}" docs/images/menu.png
convert "$shots/result.png" "${small[@]}" docs/images/result.png
convert "$shots/check_flips.png" "${small[@]}" docs/images/check.png
# The UV editor before, both editors and the report line after.
convert \( "$shots/improve_before.png" -crop 525x745+0+28 +repage \) \( "$shots/improve_after.png" -crop 1050x772+0+28 +repage \) \
  -background '#181818' -gravity north +append "${small[@]}" docs/images/improve.png
# A pin on its way inwards, and back.
convert -delay 12 "$shots"/live_step_*.png -crop 440x430+55+205 +repage -resize 75% -duplicate 1,-2-1 -dither None -colors 24 \
  -layers Optimize docs/images/live_pins.gif
