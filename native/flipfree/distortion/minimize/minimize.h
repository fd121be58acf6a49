// Minimises the symmetric Dirichlet energy of a flip-free map, keeping it flip-free: projected
// Newton.
//
// Based on: Smith, de Goes, Kim 2019 (analytic eigensystems, see symmetric_dirichlet.h); Smith,
// Schaefer 2015 (step to the first flip); Liu, Ye, Ni, Fu 2018, "Progressive Parameterizations"
// (reference shapes of bounded distortion while the map is far from its target). Thesis 3.2 and 3.3
// end with this step.
#pragma once

#include <utility>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/distortion/energy/minimize_options.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::distortion {

// chart: one disk-like or any other oriented manifold piece, already cut (one UV per vertex).
// initial_uv: #V x 2.
//
// Precondition: every triangle of initial_uv is positively oriented by the exact test; throws
// InvalidInput (kBadOption) naming faces otherwise. Guarantee: the same holds for the result; fixed
// vertices are bitwise unchanged; the energy at the best scale is not higher than the initial one,
// except by the rounding of an optional final change of unit. The same bits for any number of
// threads. Without fixed vertices the result is scaled to the surface's own unit (best global scale
// 1) and its bounding box is centred at the origin. With them the scale is theirs.
//
// Cost: about 10 iterations, each one factorization of a planar-like system with 2 #V unknowns;
// with `bijective`, twice that for maps whose boundary would meet itself. Throws Cancelled,
// NotConverged (kFactorizationFailed, unless keep_last). When the context's time is over the
// steps end and the last map is returned; TimeIsOver only where it is before the first.
Minimized minimize_distortion(const mesh::Surface& chart, const Points2& initial_uv,
                              const MinimizeOptions& options, ExecutionContext& context);

// Least distortion subject to targets: chosen vertices are brought to given places along a
// flip-free path.

// Flip-free in any case.
struct TargetsResult : Minimized {
  double fraction = 0;  // of the targets' total way; 1 exactly when all are met bit for bit
  std::vector<VertexId> missed;  // targets that were not reached, ascending
};

// Moves the vertices named by `targets` from where they are in initial_uv to their targets, then
// minimises the distortion with them held there. options.fixed are held all the time. Preconditions
// and errors are those of minimize_distortion(), and every vertex has at most one target.
// Guarantee: the result is flip-free (and its boundary does not meet itself, with
// options.bijective); targets not listed in `missed` are met bit for bit. There is no guarantee
// that targets are reached even if a map on this triangulation exists: the path is found by
// descent, and refinement may be needed (thesis 3.3).
TargetsResult minimize_with_targets(const mesh::Surface& chart, const Points2& initial_uv,
                                    const std::vector<std::pair<VertexId, Vector2>>& targets,
                                    const MinimizeOptions& options, ExecutionContext& context);

}  // namespace flipfree::distortion
