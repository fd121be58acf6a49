// A point that refinement of the start adds to the surface.
#pragma once

#include "flipfree/intrinsic/refined_start/flat_surface.h"

namespace flipfree::intrinsic {

// A point to be added: inside a face, or on an edge.
struct AddedPoint {
  FacePoint place;
  HalfedgeId edge = kInvalid;  // of the input, if the point lies on one
  double share = 0.0;          // of the way along `edge`
};

}  // namespace flipfree::intrinsic
