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
#include "flipfree/base/stats.h"
#include "flipfree/base/types.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::distortion {

// How a descent of the symmetric Dirichlet energy goes, and when it ends.

struct MinimizeOptions {
  int max_iterations = 200;
  // Stop when a full Newton step promises to lower the energy by less than this share of it. The
  // step is still taken.
  double tolerance = 1e-4;
  // A map of at most this energy (mean, 1: isometric) is good enough: what hinders steps there is
  // not worked off.
  double enough = 0;
  // Vertices that keep their initial UV bit for bit.
  std::vector<VertexId> fixed;
  // The chart's boundary may not touch itself. Precondition: it does not in the initial map.
  bool bijective = false;
  // With `bijective`: the boundary is held apart from the first step on, for maps that are known to
  // overlap without. Otherwise only where a descent without has ended in an overlap.
  bool held_apart = false;
  // With `bijective`, where the descent without holding apart ends in an overlap: not null, and its
  // map is put here; the last map of the descent that did not overlap is the result, as it is.
  Points2* overlapping = nullptr;
  // With `overlapping`: the descent goes no further than to the first map that overlaps.
  bool ends_at_overlap = false;
  // Also try steps beyond the full Newton step, doubled while the energy falls, up to 8 times. The
  // convexified Hessian is too stiff where maps are drawn out far; there this takes a third of the
  // steps. Not while parts of the boundary are held apart.
  bool lengthen = false;
  // Rounds of pulling that minimize_with_targets() may spend on the way.
  int max_pulls = 200;
  // UV length of a surface length 1 at which the energy is measured, for charts that are a part of
  // another; 0: whatever is best for the chart. Needs fixed vertices; not with `bijective`.
  double unit = 0;
  // The result is the caller's: accept() ends the descent once the energy is bearable, as the end
  // of its time does (not the way to targets before it).
  bool acceptable = false;
  // A step whose system has no factorization ends the descent with the last map instead of an
  // exception.
  bool keep_last = false;
};

// Why a descent ended. kOverlap: MinimizeOptions::overlapping; kNotFactorized: keep_last.
enum class Stop { kConverged, kStalled, kIterationLimit, kTimeLimit, kOverlap, kNotFactorized };

struct Minimized {
  Points2 uv;
  Stop stop = Stop::kConverged;
  double energy = 0;  // of uv
  int iterations = 0;
  int factorizations = 0;  // Newton systems that were solved
  // Of the way to targets; 1 exactly when all are met bit for bit.
  double fraction = 1;
};

// The figures as "distortion.*".
void report(const Minimized& descent, Stats& stats);

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

// A better place to start from than a circle: the spectral conformal map with free boundary
// (Mullen, Tong, Alliez, Desbrun 2008). It carries no guarantee, so callers test it exactly and
// keep their own map if it fails.

// #V x 2, or 0 x 2 if the conformal energy could not be factorized. `seed` (#V x 2) starts the
// inverse iteration and decides the orientation. Nothing is guaranteed about flips or overlaps.
// Cost: one factorization with 2 #V unknowns and a few solves.
Points2 spectral_conformal_map(const mesh::Surface& chart, const Points2& seed,
                               ExecutionContext& context);

}  // namespace flipfree::distortion
