// A chart that lies on itself.
#pragma once

#include <cmath>
#include <numbers>

#include "flipfree/mesh/surface.h"

namespace flipfree::test {

// A strip, its first coordinate along a circle of mean radius 1, bent over so many turns: what is
// beyond one turn lies on its beginning.
inline Points2 bent(const mesh::Surface& strip, double turns) {
  Points2 uv(strip.vertices.rows(), 2);
  const double length = strip.vertices.col(0).maxCoeff();
  const double width = strip.vertices.col(1).maxCoeff();
  for (VertexId v = 0; v < uv.rows(); ++v) {
    const double angle = 2 * std::numbers::pi * turns * strip.vertices(v, 0) / length;
    const double radius = 1.1 - 0.2 * strip.vertices(v, 1) / width;
    uv.row(v) << radius * std::cos(angle), radius * std::sin(angle);
  }
  return uv;
}

}  // namespace flipfree::test
