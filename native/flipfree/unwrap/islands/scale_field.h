// The scale factor of a surface's conformal map that keeps lengths along some vertices.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::unwrap {

// u = 0 at open vertices and (cotan Laplacian) u = angle defect elsewhere: to first order the
// logarithm by which lengths change at each vertex (Ben-Chen, Gotsman, Bunin 2008). Cotangents of
// slivers are clamped: only heuristics depend on them.
class ScaleField {
 public:
  // Both must outlive this. Cost: O(#F).
  ScaleField(const mesh::Surface& surface, const mesh::Adjacency& adjacency);

  // u, #V; all zero if the system cannot be solved. open: #V flags, at least one in every
  // component; every vertex that is not open lies inside. Cost: one factorization with #V unknowns.
  std::vector<double> solve(const std::vector<char>& open, ExecutionContext& context) const;

 private:
  const mesh::Surface& surface_;
  const mesh::Adjacency& adjacency_;
  std::vector<double> half_cotangent_;  // of the angle opposite to each half-edge, clamped
  std::vector<double> defect_;          // per vertex: 2 pi minus its corner angles
};

}  // namespace flipfree::unwrap
