// Unwrap Flip-Free: every seam island onto the plane without a flipped triangle, with low
// distortion, on the input's own triangulation (design: section 1).
#pragma once

#include "flipfree/base/context.h"
#include "flipfree/certify/parametrization.h"
#include "flipfree/unwrap/islands/islands.h"

namespace flipfree::unwrap {

// Result: uv and uv32 certified (G1, G2, G3 for pins, G7; overlaps 0 if bijective; without pins
// charts are disjoint), cut_edges = seams and added cuts. All charts without pins have one scale:
// the same area per area of their surface, that of the pinned ones if there are any and there is
// room. Stats: "charts", "opened_charts", "added_cuts" (edges), "overlap_cuts" (those of them that
// keep charts from overlapping), "energy", "kept_places", "tile", "fill", "margin_met" (place.h),
// "seconds_*", "time_limit_reached", and what the chart solvers report of the largest chart. Any
// triangles: what is no oriented manifold surface is separated first (mesh/separated/separated.h).
// Throws InvalidInput (a mesh without meaning, options), Infeasible (pins), NotConverged with what
// failed (kTimeLimit: some chart was not flat in max_seconds), Cancelled. Nothing is returned that
// did not pass the certificate. Cost: a few factorizations of a planar-like system per chart;
// docs/benchmarks.md.
certify::Parametrization unwrap(const mesh::Surface& surface, const UnwrapOptions& options,
                                ExecutionContext& context);

}  // namespace flipfree::unwrap
