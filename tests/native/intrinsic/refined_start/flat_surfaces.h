// Flat surfaces of the shapes of other tests.
#pragma once

#include "flipfree/intrinsic/refined_start/flat_surface.h"
#include "flipfree/mesh/surface.h"
#include "support/shapes.h"

namespace flipfree::test {

inline intrinsic::FlatSurface flat(const mesh::Surface& s) {
  return intrinsic::make_flat_surface(static_cast<Index>(s.vertices.rows()), s.faces,
                                      intrinsic::lengths_of(s.vertices, s.faces));
}

}  // namespace flipfree::test
