#include "flipfree/certify/pins.h"

#include <string>

#include "flipfree/base/error.h"
#include "flipfree/base/plane.h"

namespace flipfree::certify {

void require_corners(const std::vector<CornerPin>& pins, Index corners) {
  for (const CornerPin& pin : pins) {
    if (pin.corner >= 0 && pin.corner < corners) continue;
    throw_invalid(ErrorCode::kBadPins, "A pin names corner " + corner_id(pin.corner) +
                                           ", which does not exist. Pin corners of the mesh.");
  }
}

void require_storable_pins(const std::vector<CornerPin>& pins, Index corners) {
  require_corners(pins, corners);
  for (const CornerPin& pin : pins) {
    if (is_storable(pin.uv)) continue;
    throw_invalid(ErrorCode::kBadPins,
                  "The pin of corner " + corner_id(pin.corner) +
                      " is at a place that UVs cannot store (up to 3.4e38). Correct it.",
                  ElementKind::kCorner, {pin.corner});
  }
}

}  // namespace flipfree::certify
