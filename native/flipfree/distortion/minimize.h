// Minimises the symmetric Dirichlet energy of a flip-free map, keeping it flip-free: projected
// Newton.
//
// Based on: Smith, de Goes, Kim 2019 (analytic eigensystems, see symmetric_dirichlet.h); Smith,
// Schaefer 2015 (step to the first flip); Liu, Ye, Ni, Fu 2018, "Progressive Parameterizations"
// (reference shapes of bounded distortion while the map is far from its target). Thesis 3.2 and 3.3
// end with this step.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/stats.h"
#include "flipfree/mesh/surface.h"
#include "flipfree/numeric/elimination_memory.h"

namespace flipfree {

struct MinimizeOptions {
  int max_iterations = 200;
  // Stop when a full Newton step promises to lower the energy by less than this share of it. The
  // step is still taken.
  double tolerance = 1e-4;
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
  // Also try steps beyond the full Newton step, doubled while the energy falls, up to 8 times. The
  // convexified Hessian is too stiff where maps are drawn out far; there this takes a third of the
  // steps. Not while parts of the boundary are held apart.
  bool lengthen = false;
  // Rounds of pulling that minimize_with_targets() may spend on the way.
  int max_pulls = 200;
  // Elimination orders of former calls by vertex, for meshes that differ little; null: none.
  EliminationMemory* memory = nullptr;
  // What the memory knows each vertex by (#V, ascending); null: its id.
  const std::vector<Index>* labels = nullptr;
  // UV length of a surface length 1 at which the energy is measured, for charts that are a part of
  // another; 0: whatever is best for the chart. Needs fixed vertices; not with `bijective`.
  double unit = 0;
  // The result is the caller's: accept() ends the descent once the energy is bearable, with a stop
  // "time limit" (not the way to targets before it).
  bool acceptable = false;
};

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
// "stalled", "time limit", "overlap": MinimizeOptions::overlapping).
// Cost: about 10 iterations, each one factorization of a planar-like system with 2 #V unknowns;
// with `bijective`, twice that for maps whose boundary would meet itself. Throws Cancelled,
// NotConverged (kFactorizationFailed). When the context's time is over the steps end and the last
// map is returned; TimeIsOver only where it is before the first.
Points2 minimize_distortion(const Surface& chart, const Points2& initial_uv,
                            const MinimizeOptions& options, ExecutionContext& context,
                            Stats& stats);

}  // namespace flipfree
