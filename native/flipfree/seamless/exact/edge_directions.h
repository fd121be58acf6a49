// Which way up a seamless map lies: its axes along the edges of the mesh.
#pragma once

#include <vector>

#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::seamless {

// Turns every chart of a closed part so that its edges, `diagonals` left out, run along the axes as
// well as one turn can make them: the sum of length cos(4 angle) is largest. Seams stay seams up to
// rounding, as quarter turns are the same in every direction. `chart_of_face`: numbers from 0 to
// `charts` - 1; `diagonals`: vertex pairs. A chart with an edge on the surface's boundary stays:
// there the boundary decides. Cost: O(#F + diagonals log diagonals).
void turn_along_edges(const Triangles& faces, const mesh::Adjacency& adjacency,
                      const std::vector<Index>& chart_of_face, Index charts,
                      const IndexPairs& diagonals, Points2& corner_uv);

}  // namespace flipfree::seamless
