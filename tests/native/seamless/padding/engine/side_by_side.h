// A surface of two components.
#pragma once

#include "flipfree/mesh/surface.h"

namespace flipfree::test {

// The surface twice, one beside the other.
inline mesh::Surface side_by_side(const mesh::Surface& one) {
  const Eigen::Index count = one.vertices.rows();
  mesh::Surface both{Points3(2 * count, 3), Triangles(2 * one.faces.rows(), 3)};
  both.vertices << one.vertices, one.vertices.array() + 5.0;
  both.faces << one.faces, one.faces.array() + static_cast<Index>(count);
  return both;
}

}  // namespace flipfree::test
