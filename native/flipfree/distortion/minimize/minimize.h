// Minimises the symmetric Dirichlet energy of a flip-free map, keeping it flip-free: projected
// Newton.
//
// Based on: Smith, de Goes, Kim 2019 (analytic eigensystems, see symmetric_dirichlet.h); Smith,
// Schaefer 2015 (step to the first flip); Liu, Ye, Ni, Fu 2018, "Progressive Parameterizations"
// (reference shapes of bounded distortion while the map is far from its target). Thesis 3.2 and 3.3
// end with this step.
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
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
// stats: "distortion.*": iterations, progressive_iterations, factorizations, energy_start, energy,
// seconds, barrier (1 if the boundary had to be held apart), stop ("converged", "iteration limit",
// "stalled", "time limit", "overlap": MinimizeOptions::overlapping, "not factorized": keep_last).
// Cost: about 10 iterations, each one factorization of a planar-like system with 2 #V unknowns;
// with `bijective`, twice that for maps whose boundary would meet itself. Throws Cancelled,
// NotConverged (kFactorizationFailed, unless keep_last). When the context's time is over the
// steps end and the last map is returned; TimeIsOver only where it is before the first.
Points2 minimize_distortion(const mesh::Surface& chart, const Points2& initial_uv,
                            const MinimizeOptions& options, ExecutionContext& context,
                            Stats& stats);

}  // namespace flipfree::distortion
