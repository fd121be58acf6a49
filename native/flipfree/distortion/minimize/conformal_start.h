// A better place to start from than a circle: the spectral conformal map with free boundary
// (Mullen, Tong, Alliez, Desbrun 2008). It carries no guarantee, so callers test it exactly and
// keep their own map if it fails.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::distortion {

// #V x 2, or 0 x 2 if the conformal energy could not be factorized. `seed` (#V x 2) starts the
// inverse iteration and decides the orientation. Nothing is guaranteed about flips or overlaps.
// Cost: one factorization with 2 #V unknowns and a few solves.
Points2 spectral_conformal_map(const mesh::Surface& chart, const Points2& seed,
                               ExecutionContext& context);

}  // namespace flipfree::distortion
