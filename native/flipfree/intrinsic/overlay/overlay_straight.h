// Straight edges for inputs that are not Delaunay.
//
// locate_crossings() draws every edge of the input as a hyperbolic geodesic of the Delaunay start
// D. For an edge that Euclidean flips removed this is not the straight line that it is on the
// input: among needles the curves of many edges are pressed together. Where such an edge crosses an
// edge of D that is still there in the final triangulation, the true place is known: straight lines
// over D in its Euclidean metric give it on both, and the projective map along an edge is a
// rescaling by the factors of its ends (thesis 4.5). These places are moved there; crossings with
// edges that Ptolemy flips made keep theirs, relative to the moved ones before and after.
//
// Order along edges and curves, which is what makes the overlay a valid refinement, is kept by
// construction: an edge where places in double are out of order (exact positions come from the
// integer coordinates) is left as it was.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/intrinsic/flipped_metric.h"
#include "flipfree/intrinsic/overlay/overlay_positions.h"
#include "flipfree/intrinsic/overlay/overlay_trace.h"

namespace flipfree::intrinsic {

struct Straightened {
  std::size_t moved = 0;      // crossings that got their true place
  std::size_t kept = 0;       // crossings of edges that are not Delaunay that kept the other one
  double largest_move = 0.0;  // along an input edge, share of its length
};

// Where a straight line over D crosses one of its edges.
struct StraightCrossing {
  HalfedgeId through = kInvalid;
  Between on_edge;  // in the Euclidean metric; source < 0: lost in rounding
  Between on_curve;
};
struct StraightCurves {
  std::vector<std::int64_t> begin;  // #curves + 1; empty if lengths cannot be trusted
  std::vector<StraightCrossing> crossings;
  std::span<const StraightCrossing> of_curve(std::size_t c) const {
    return {crossings.data() + begin[c], static_cast<std::size_t>(begin[c + 1] - begin[c])};
  }
};

// The straight lines of `curves`. `start`: coordinates after the Euclidean flips alone. Cost: O(#E
// + crossings).
StraightCurves follow_straight(const FlippedMetric& metric, const OverlayCoordinates& start,
                               const std::vector<HalfedgeId>& curves,
                               const std::vector<long double>& initial_length,
                               const ExecutionContext& context);

// `trace`, `positions`: of the final triangulation, the same curves; `scale`: u per vertex of the
// mesh. Cost: O(#E + crossings log crossings).
Straightened straighten(const FlippedMetric& metric, const OverlayTrace& trace,
                        const StraightCurves& straight, const std::vector<long double>& scale,
                        OverlayPositions& positions, const ExecutionContext& context);

}  // namespace flipfree::intrinsic
