// What is left where slits are not enough: an island cut in two.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/mesh/cut.h"

namespace flipfree::unwrap {

// Flags of a short cut across the chart (separating_cut()) that parts a quarter of its faces at one
// end of its map from a quarter at the other, or of one around about half of its faces. Faces with
// an `uncuttable` edge between them (may be empty) stay together, and faces that are but lines,
// which cannot be stored alone, stay with a neighbour; all 0 where nothing else is left.
// corner_uv: 3 #F x 2. Cost: a minimum cut of the faces' graph.
mesh::EdgeFlags halving_cut(const mesh::Surface& chart, const mesh::Adjacency& adjacency,
                            const Points2& corner_uv, const mesh::EdgeFlags& uncuttable,
                            ExecutionContext& context);

}  // namespace flipfree::unwrap
