// What a development is made of (development.h): the overlay of the user's triangulation with the
// final one.
#pragma once

#include <vector>

#include "flipfree/intrinsic/overlay.h"

namespace flipfree::intrinsic {

// A place in the plane; 80-bit numbers for their range.
struct Place {
  long double x = 0;
  long double y = 0;
};

struct TracedMesh {
  const OverlayCoordinates* coordinates = nullptr;
  const OverlayTrace* trace = nullptr;
  const OverlayPositions* positions = nullptr;
  const std::vector<HalfedgeId>* halfedge_of_corner =
      nullptr;  // 3 #F: half-edge of M0, corner k to k + 1
  const std::vector<Index>* curve_of_edge =
      nullptr;                             // #E of M0: curve that traces it, kInvalid = none
  const std::vector<char>* cut = nullptr;  // #E of M0: is it a cut or boundary?
};

}  // namespace flipfree::intrinsic
