// A chart that is slit until it can be laid flat: where it has to give way, and its mirror
// symmetry.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::unwrap {

// The scale factor of a surface's conformal map that keeps lengths along its open vertices, #V: u =
// 0 there, and (cotan Laplacian) u = angle defect elsewhere: to first order the logarithm by which
// lengths change at each vertex (Ben-Chen, Gotsman, Bunin 2008). Cotangents of slivers are clamped:
// only heuristics depend on them. All zero if the system cannot be solved. open: #V flags, at least
// one in every component; every vertex that is not open lies inside. Cost: one factorization with
// #V unknowns.
std::vector<double> scale_field(const mesh::Surface& surface, const std::vector<char>& open,
                                ExecutionContext& context);

// Where a surface has to give way: the hills of its scale field, and what a seam to each of them is
// worth.

struct Hill {
  VertexId peak = kInvalid;  // its highest vertex that a seam may reach
  double gain = 0.0;         // integral of (|u| - foot)^2 over the hill
  double height = 0.0;       // of its highest vertex, and where it meets a higher hill
  double foot = 0.0;
};

// The hills of |u|, those of either sign by themselves; not sorted. u: #V, zero at open vertices,
// which border hills; all others lie inside. area: #V. reach: #V flags; hills that
// no seam may reach are left out. Deterministic. Vertices are taken from the
// highest down, and where two hills meet, the lower one ends (persistence; Edelsbrunner, Letscher,
// Zomorodian 2002). Cost: O(#V log #V).
std::vector<Hill> hills(const mesh::Surface& surface, const std::vector<double>& u,
                        const std::vector<double>& area, const std::vector<char>& reach);

// A plane that maps the chart to itself.
struct Mirror {
  std::vector<VertexId> image;   // per vertex: its mirror image; itself on the plane
  std::vector<HalfedgeId> edge;  // per half-edge: one of the mirrored edge's; kInvalid: none
  std::vector<int> side;  // per half-edge: on which side its edge lies, 1 or -1; 0 in the middle

  bool empty() const { return image.empty(); }
};

// For charts of which no mirror symmetry is looked for.
inline const Mirror kNoMirror;

// Planes through the middle of the vertices across an axis of the coordinates (x, y, z), or of the
// vertices' spread, are tried in this order; the first is taken that maps all vertices to vertices,
// to a hundred-thousandth of the size, all edges that may be seams to such edges, and borders to
// borders. The diagonals of polygons need not match, as long as their cost is infinite. Empty where
// there is none, or costs differ, as where one side is painted. cost: per half-edge. Cost: O(#F).
Mirror find_mirror(const mesh::Surface& chart, const std::vector<double>& cost);

// Costs that are the same on both sides; less on the plane; all as they are without a mirror.
// Cost: O(#F).
std::vector<double> mirrored_costs(const Triangles& faces, const Mirror& mirror,
                                   std::vector<double> cost);

}  // namespace flipfree::unwrap
