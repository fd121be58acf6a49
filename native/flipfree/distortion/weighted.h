// Least distortion where some triangles count more than others.
#pragma once

#include <vector>

#include "flipfree/distortion/minimize/minimize.h"

namespace flipfree::distortion {

// minimize_distortion() with every triangle's share of the energy, which is its area, times its
// factor. factors: #F, positive.
Points2 minimize_weighted(const mesh::Surface& chart, const std::vector<double>& factors,
                          const Points2& initial_uv, const MinimizeOptions& options,
                          ExecutionContext& context, Stats& stats);

}  // namespace flipfree::distortion
