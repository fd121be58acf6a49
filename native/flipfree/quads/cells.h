// From integers to quads: every unit cell of the coarse surface is one.
//
// The centre of every cell lies in exactly one triangle, by a half-open rule on its edges. From
// there one walks to the four corners of the cell; the open cell holds no cone, so that every way
// leads to the same corner. What tells corners apart is the vertex, the edge and place on it, or
// the triangle and place in it that they lie on. All in integers: which quads there are, and how
// they hang together, depends on the coarse surface alone, and their number is its area.
//
// Based on the idea of Ebke, Bommes, Campen, Kobbelt, "QEx: Robust Quad Mesh Extraction" (2013),
// that exact coordinates make extraction a matter of integers; cells instead of traced isolines are
// ours.
#pragma once

#include <array>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/quads/coarse.h"

namespace flipfree::quads {

// Where a corner or a centre lies on the coarse surface: on a half-edge's source if `at_vertex`;
// else at half of `doubled` in the chart of the half-edge's face, relative to the half-edge's
// source. Of corners on an edge the half-edge is one of the edge's; others are given with the first
// of their face.
struct Carrier {
  HalfedgeId halfedge = kInvalid;
  Gauss doubled;
  bool at_vertex = false;
  bool on_edge = false;
};

struct Cells {
  std::vector<Carrier> corners;                // numbered as they are met
  std::vector<std::array<VertexId, 4>> quads;  // counter-clockwise, numbers of corners
  std::vector<Carrier> centres;                // of the quads
};

// Precondition: integers are chosen, with positive areas. Throws Cancelled, TimeIsOver. Cost: about
// O(#quads).
Cells extract_cells(const CoarseSurface& coarse, const ExecutionContext& context);

}  // namespace flipfree::quads
