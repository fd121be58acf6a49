// Mirror symmetry of a chart.
#pragma once

#include <vector>

#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::unwrap {

// A plane that maps the chart to itself.
struct Mirror {
  std::vector<VertexId> image;   // per vertex: its mirror image; itself on the plane
  std::vector<HalfedgeId> edge;  // per half-edge: one of the mirrored edge's; kInvalid: none

  bool empty() const { return image.empty(); }
};

// For charts of which no mirror symmetry is looked for.
inline const Mirror kNoMirror;

// Planes through the middle of the vertices across an axis of the coordinates (x, y, z), or of the
// vertices' spread, are tried in this order; the first is taken that maps all vertices to vertices,
// to a hundred-thousandth of the size, all edges that may be seams to such edges, and borders to
// borders. The diagonals of polygons need not match, as long as their cost is infinite. Empty where
// there is none, or costs differ, as where one side is painted. cost: per half-edge. Cost: O(#F).
Mirror find_mirror(const mesh::Surface& chart, const mesh::Adjacency& adjacency,
                   const std::vector<double>& cost);

// Costs that are the same on both sides; less on the plane. Cost: O(#F).
std::vector<double> mirrored_costs(const Triangles& faces, const Mirror& mirror,
                                   std::vector<double> cost);

}  // namespace flipfree::unwrap
