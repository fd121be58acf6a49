// The scale factor of a surface's conformal map that keeps lengths along some vertices.
#pragma once

#include <functional>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/adjacency.h"
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
  double defect(VertexId v) const { return defect_[static_cast<std::size_t>(v)]; }

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

}  // namespace flipfree::unwrap
