// Rest shapes that one Newton step sees: the true ones at the best scale, or, while the map is far
// from them, shapes between the map and the target with bounded distortion (Liu, Ye, Ni, Fu 2018,
// section 4).
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/distortion/energy/symmetric_dirichlet.h"

namespace flipfree::distortion {

// Bound on f of each triangle with respect to its intermediate rest shape: the figure of the paper.
inline constexpr double kProgressiveBound = 4.6;

// All rest lengths divided by `scale`.
void scale_rest(const std::vector<RestTriangle>& rest, double scale,
                const ExecutionContext& context, std::vector<RestTriangle>& working);

// The same, then every rest shape whose f exceeds kProgressiveBound is drawn towards the current UV
// triangle along its singular directions (J = U S V' becomes U S^t V') until f = kProgressiveBound.
// Weights become uniform, as the share of the surface says nothing about how hard a triangle is to
// untangle.
void progressive_rest(const Triangles& faces, const std::vector<RestTriangle>& rest, double scale,
                      const Points2& uv, const ExecutionContext& context,
                      std::vector<RestTriangle>& working);

}  // namespace flipfree::distortion
