// How much of a surface is seen, and from where there is most to see.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::unwrap {

// Per vertex, how much of the surface around it is seen by an observer who may stand anywhere: 1
// for a ball, less where other parts are in front, less on the sides that show little. The surface
// is drawn from evenly distributed directions, faces hiding what lies behind them; a direction
// counts by how much the seen faces bend, a face that is drawn by the share of its projection that
// is seen. Faces are seen from behind as well, so that their orientation does not matter.
// positions: any that are finite. Deterministic, the same for any number of threads. Cost: O(#F)
// per direction, some tens of them.
std::vector<double> exposure(const Points3& positions, const Triangles& faces,
                             const mesh::Adjacency& adjacency, ExecutionContext& context);

}  // namespace flipfree::unwrap
