// How a descent of the symmetric Dirichlet energy goes, and when it ends (minimize.h).
#pragma once

#include <vector>

#include "flipfree/base/stats.h"
#include "flipfree/base/types.h"

namespace flipfree::distortion {

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
  double energy_start = 0;
  double energy = 0;  // of uv
  double seconds = 0;
  int iterations = 0;
  int progressive_iterations = 0;
  int factorizations = 0;  // Newton systems that were solved
  bool barrier = false;    // did the boundary have to be held apart?
};

// The figures as "distortion.*".
void report(const Minimized& descent, Stats& stats);

}  // namespace flipfree::distortion
