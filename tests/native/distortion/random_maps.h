// Flip-free maps at random, for tests of energies and of what minimises them.
#pragma once

#include <random>

#include "flipfree/distortion/energy/energy.h"
#include "support/shapes.h"

namespace flipfree::test {

// A bumpy grid's projection with every vertex moved at random, by less where that would flip.
inline Points2 random_map(const mesh::Surface& surface, double by, std::mt19937& random) {
  std::uniform_real_distribution<double> motion(-by, by);
  const ExecutionContext context;
  Points2 uv = surface.vertices.leftCols<2>();
  for (Eigen::Index v = 0; v < uv.rows(); ++v) {
    const Vector2 before = uv.row(v);
    uv.row(v) += Eigen::RowVector2d(motion(random), motion(random));
    if (!distortion::is_flip_free(surface.faces, uv, context)) uv.row(v) = before;
  }
  return uv;
}

}  // namespace flipfree::test
