// How far a metric must be scaled, to first order, so that its angles become others: what makes
// them hard to reach.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/seamless/padding/admissible_cut.h"

namespace flipfree::seamless {

// Per half-edge 3 f + k the cotangent weight of its edge, kept between a hundredth and a hundred: a
// needle is not to decide.
std::vector<double> edge_weights(const mesh::Surface& surface);

// u with L u = wish - own angles, per vertex; zero at the last one. `surface`: connected, with or
// without boundary; `weight`: edge_weights(); `wish`: radians per vertex, with the right sum. The
// metric is to be scaled by exp(-u). Throws NotConverged (kFactorizationFailed). Cost: one sparse
// factorization.
std::vector<double> linear_scale(const mesh::Surface& surface, const std::vector<double>& weight,
                                 const std::vector<double>& wish, ExecutionContext& context);

// Largest less smallest u of a piece of the surface cut along a cut, its sides straight and its
// corners right angles; of all pieces the largest such range. `cones`: of the surface before it was
// cut, quarter turns; vertices that the cut added are flat. Cost: as above.
double scale_range(const AdmissibleCut& cut, const std::vector<Index>& cones,
                   ExecutionContext& context);

}  // namespace flipfree::seamless
