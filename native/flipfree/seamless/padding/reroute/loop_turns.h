// By how much loops of a cut turn: on the map that padding will make, and as they are asked to
// (thesis 6.5.3).
#pragma once

#include <functional>
#include <vector>

#include "flipfree/intrinsic/loops/dual_loops.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/seamless/padding/paths/canvas.h"
#include "flipfree/seamless/padding/reroute/branch_graph.h"

namespace flipfree::seamless {

// By how many quarter turns, to the left, a map is to turn along a closed strip of the surface's
// faces (half-edges 3 f + k, never turning back). It must be that of some cross field
// (field::turning_number), so that it goes together with the cones.
using LoopTurning = std::function<Index(const intrinsic::DualLoop& strip)>;

// What will be drawn on a cut yet, as far as it bends the curves that are there.
struct Ending {
  // Sectors, named by their ends, that a path will divide in two: one more corner each.
  std::vector<Index> divided;
  // A branch, named by one of its ends, on whose left hand, as walked along from there, a loop will
  // begin and end: three corners on that side, one on the other. Or kInvalid.
  Index bent = kInvalid;
};

// Quarter turns to the left of the map that padding will make along the loop, on its left side:
// branches are straight, sectors of nodes are right angles, but for those that are divided.
Index turn_to_come(const BranchGraph& graph, const BranchLoop& loop, const Ending& ending);

// The faces on the left of a closed chain of edges, drawn or not, as a strip of the input's faces.
// `input_adjacency`: of the surface that the canvas was made of. Cost: O(faces beside the loop).
intrinsic::DualLoop strip_on_input(const Canvas& canvas, const mesh::Adjacency& input_adjacency,
                                   const std::vector<VertexId>& cycle);
// Those on the left of a loop of branches.
intrinsic::DualLoop strip_on_input(const Canvas& canvas, const mesh::Adjacency& input_adjacency,
                                   const BranchGraph& graph, const BranchLoop& loop);

}  // namespace flipfree::seamless
