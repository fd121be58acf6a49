// Pins of face corners, and what every function that takes them asks of them.
#pragma once

#include <vector>

#include "flipfree/base/types.h"

namespace flipfree::certify {

struct CornerPin {
  CornerId corner = kInvalid;  // 3 f + k
  Vector2 uv = Vector2::Zero();
};

// Throws InvalidInput (kBadPins) for a pin of a corner that a mesh of so many corners has not.
void require_corners(const std::vector<CornerPin>& pins, Index corners);

// The same, and for a place that 32-bit UVs cannot hold.
void require_storable_pins(const std::vector<CornerPin>& pins, Index corners);

}  // namespace flipfree::certify
