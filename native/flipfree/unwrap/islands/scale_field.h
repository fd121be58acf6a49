// The scale factor of a surface's conformal map that keeps lengths along some vertices.
#pragma once

#include <functional>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/numeric/cholesky/cholesky.h"

namespace flipfree::unwrap {

// u = 0 at open vertices and (cotan Laplacian) u = angle defect elsewhere: to first order the
// logarithm by which lengths change at each vertex (Ben-Chen, Gotsman, Bunin 2008). Cotangents of
// slivers are clamped: only heuristics depend on them.
class ScaleField {
 public:
  // Both must outlive this. Cost: O(#F).
  ScaleField(const mesh::Surface& surface, const mesh::Adjacency& adjacency);

  // What a vertex inside lacks of the full angle.
  double defect(VertexId v) const { return defect_[at(v)]; }

  // u, #V; all zero if the system cannot be solved. open: #V flags, at least one in every
  // component; every vertex that is not open lies inside. Cost: one factorization with #V unknowns.
  std::vector<double> solve(const std::vector<char>& open, ExecutionContext& context);

  // The same, and by how much about a function of u grows with every open vertex that would be open
  // no more, each by itself: the curvature that it takes up now, times what the function loses by
  // it (the adjoint's), over the stiffness around it. slope: u -> the function's derivatives, #V.
  // Zero at vertices that are not open or on the surface's boundary. Cost: as solve().
  struct Response {
    std::vector<double> u;
    std::vector<double> closing;
  };
  using Slope = std::function<std::vector<double>(const std::vector<double>&)>;
  Response respond(const std::vector<char>& open, const Slope& slope, ExecutionContext& context);

 private:
  struct System;
  double weight(HalfedgeId h) const;
  System system(const std::vector<char>& open, ExecutionContext& context);

  const mesh::Surface& surface_;
  const mesh::Adjacency& adjacency_;
  std::vector<double> half_cotangent_;  // of the angle opposite to each half-edge, clamped
  std::vector<double> defect_;          // per vertex: 2 pi minus its corner angles
  numeric::EliminationMemory memory_;   // few vertices come or go between one call and the next
};

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
std::vector<Hill> hills(const Triangles& faces, const mesh::Adjacency& adjacency,
                        const std::vector<double>& u, const std::vector<double>& area,
                        const std::vector<char>& reach);

// Where an automatic cut is too short: the extremities of a chart (fingers, legs, horns), which a
// flat map would have to shrink by orders of magnitude.
//
// They are found from the scale factor of the conformal map that keeps the length of the boundary:
// u = 0 there, and (cotan Laplacian) u = angle defect inside, one sparse solve (Ben-Chen, Gotsman,
// Bunin 2008, who place cones at its extrema; here they become ends of slits, as in Gu, Gortler and
// Hoppe 2002, where the largest distortion of a map says where its cut has to grow).

// Flags of edges: slits along shortest paths from the boundary, or from earlier slits, to every
// peak of |u| that is high and stands out; all zero where a flat map is mild without them. The
// chart cut along them stays connected and planar. `uncuttable` as in planar_cut(). Precondition:
// connected, planar, with a boundary. Cost: a few rounds of one factorization with #V unknowns and
// O(#F log #F).
mesh::EdgeFlags cut_to_extremities(const mesh::Surface& chart, const mesh::Adjacency& adjacency,
                                   const mesh::EdgeFlags& uncuttable, ExecutionContext& context);

}  // namespace flipfree::unwrap
