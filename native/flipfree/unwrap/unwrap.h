// Unwrap Flip-Free: every seam island onto the plane without a flipped triangle, with low
// distortion, on the input's own triangulation (design: section 1).
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/certify/certify.h"
#include "flipfree/certify/parametrization.h"

namespace flipfree {

struct UnwrapOptions {
  IndexPairs cuts;        // seam edges as vertex pairs
  IndexPairs uncuttable;  // edges that automatic cuts avoid: diagonals of polygons
  std::vector<CornerPin>
      pins;               // met bit for bit; corners that share a vertex of a chart share the pin
  bool bijective = true;  // no chart overlaps itself
  // Charts that have to be cut open anyway are slit to their extremities too (extremities.h). Not
  // done if there are pins: both sides of a slit through a pinned vertex would share its place.
  bool cut_extremities = true;
  // With `bijective`, charts without pins that cannot be laid out without overlap at a distortion
  // near that of their free map are cut along further edges (separate.h) instead of crushed.
  bool may_add_cuts = true;
  int max_iterations = 200;  // of the optimiser, per chart
  double tolerance = 1e-4;   // share of the energy that a step must still promise
  // Of the clock; 0: no limit. Charts that are flat by then are made no better.
  double max_seconds = 0;
  double margin = 0.005;  // between charts, in units of the unit square
  // Former corner UVs (3 #F x 2) whose places are kept if that leaves a usable layout (place.h), or
  // null. Otherwise all charts without pins are packed, clear of those with pins.
  const Points2* place_like = nullptr;
};

// Result: uv and uv32 certified (G1, G2, G3 for pins, G7; overlaps 0 if bijective; without pins
// charts are disjoint), cut_edges = seams and added cuts. All charts without pins have one scale:
// the same area per area of their surface, that of the pinned ones if there are any and there is
// room. Stats: "charts", "opened_charts", "added_cuts" (edges), "overlap_cuts" (those of them that
// keep charts from overlapping), "energy", "kept_places", "tile" (place.h), "seconds_*",
// "time_limit_reached", and what the chart solvers report of the largest chart. Throws InvalidInput
// (see validate()), NotConverged with what failed (kTimeLimit: some chart was not flat in
// max_seconds), Cancelled. Nothing is returned that did not pass the certificate. Cost: a few
// factorizations of a planar-like system per chart; docs/benchmarks.md.
Parametrization unwrap(const Surface& surface, const UnwrapOptions& options,
                       ExecutionContext& context);

}  // namespace flipfree
