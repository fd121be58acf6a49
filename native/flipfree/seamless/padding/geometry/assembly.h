// The pieces of a cut surface in one triangulation again, each flat, the cut still open.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/intrinsic/intrinsic_mesh.h"
#include "flipfree/seamless/padding/disks/cut_disks.h"
#include "flipfree/seamless/padding/plane/flat_surface.h"

namespace flipfree::seamless {

// `setup`: of the surface that is cut; `flips` of the result lead from its mesh to that of the
// result. Edges of the cut are `fixed` and keep their half-edges. Every frame has the cut along its
// axes.
struct AssembledSurface {
  FlatSurface flat;
  double closing_error = 0.0;  // largest angle that frames miss quarter turns by, radians
};

// Throws NotConverged if the metrics are not precise enough. Cost: O(#F log #F).
AssembledSurface assemble(const std::vector<CutDisk>& disks, const intrinsic::IntrinsicSetup& setup,
                          const AdmissibleCut& cut, const ExecutionContext& context);

}  // namespace flipfree::seamless
