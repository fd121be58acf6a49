// A surface with an aligned boundary, without the edges that this would flatten
// (bordered/side_chords.h), and the way back to the user's.
#pragma once

#include <optional>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/seamless/padding/engine/refined_pieces.h"

namespace flipfree::seamless {

struct DividedSides {
  RefinedPieces pieces;   // no cuts; every such edge has a vertex on its middle, after the input's
  IndexPairs uncuttable;  // edges of it that are none of the user's polygons
  std::vector<VertexId> place;  // per vertex of it: its own number, or that of an end of its edge
};

// Nothing if there is no such edge. `cones`: quarter turns per vertex, 2 where the boundary is
// straight; `uncuttable`: edges of the input, diagonals of polygons. Throws NotConverged
// (split_in_the_middle()), Cancelled. Cost: that of side_chords(), and O(#F log #F) if there are
// any.
std::optional<DividedSides> divided_sides(const mesh::Surface& surface,
                                          const mesh::Adjacency& adjacency,
                                          const std::vector<Index>& cones,
                                          const IndexPairs& uncuttable, ExecutionContext& context);

}  // namespace flipfree::seamless
