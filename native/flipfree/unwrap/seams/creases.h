// Seams of things that are made, not grown: flat and rolled faces between creases.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::unwrap {

// Flags of edges along which the surface falls into faces between creases (edges of more than 40
// degrees) and unfolds without stretch; faces that share one straight crease stay together, in a
// tree, along the longest ones: a cube becomes a net, a cylinder a side and two caps. Only in
// connected parts (between `seams`) where nearly all curvature is at creases and few triangles
// stand alone; elsewhere nothing is flagged. Edges of infinite cost are no creases. cost: per
// half-edge. Precondition: a validated surface. Cost: O(#F log #F).
mesh::EdgeFlags crease_seams(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                             const mesh::EdgeFlags& seams, const std::vector<double>& cost);

}  // namespace flipfree::unwrap
