// The shortest change of the logarithms of edge lengths that meets the linearised equations for
// cone and loop angles (Capouellez, Zorin 2024): d = w + J' m with J d = g, nearest to a wish w.
//
// Unlike penner_system.h it counts conformal changes as well: it is what keeps a metric near
// another one, and what has to be factorized is J J', with twelve neighbours a vertex.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/intrinsic/loops/loop_carrier.h"
#include "flipfree/numeric/cholesky/cholesky.h"
#include "flipfree/seamless/penner/penner_system.h"

namespace flipfree::seamless {

class ShortestSystem {
 public:
  // `wish`, `direction`: per edge. False if J J' is not positive definite to working precision.
  // Cost: an analysis and a factorization of the vertices' part, O(genus) solutions; loops enter by
  // their Schur complement.
  bool solve(const intrinsic::IntrinsicMesh& mesh, const intrinsic::LoopCarrier& loops,
             const PennerAngles& angles, const std::vector<double>& wish,
             std::vector<double>& direction, ExecutionContext& context);

 private:
  numeric::SparseCholesky cholesky_;
};

}  // namespace flipfree::seamless
