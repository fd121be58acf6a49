// Loops of a surface as loops of the same surface with some of its edges divided.
#pragma once

#include <vector>

#include "flipfree/intrinsic/loops/dual_loops.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/refined/provenance.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::holonomy {

using intrinsic::LoopTurn;

// The same loops up to homotopy beside all vertices, so that they turn alike in every metric that
// is flat at the new ones; no face is passed twice that was not before. Precondition: new vertices
// of `divided` lie inside edges of the input that are not on its boundary, one on each at most, and
// the pieces of a face are joined as in a tree (split_in_the_middle()). Cost: O(#F + loops).
std::vector<LoopTurn> carried_loops(const mesh::Surface& surface, const mesh::Surface& divided,
                                    const mesh::Adjacency& adjacency,
                                    const mesh::Provenance& provenance,
                                    const std::vector<LoopTurn>& loops);

}  // namespace flipfree::holonomy
