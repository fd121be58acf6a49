// Filling holes virtually: a fan around one new vertex per boundary loop, so that a surface with
// holes can be embedded as a disk at the start. The fans never reach the user's mesh.
#pragma once

#include <vector>

#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::mesh {

struct FilledSurface {
  Surface
      surface;  // the input's vertices and faces first, then one vertex and a fan of faces per loop
};

// Fills the given loops (boundary half-edges in order). New vertices lie at the loops' centroids.
FilledSurface fill_holes(const Surface& surface, const std::vector<std::vector<HalfedgeId>>& loops);

}  // namespace flipfree::mesh
