// The common refinement of the input triangulation M0 and the final one T, read off the normal
// coordinates: every edge of M0 as a chain of half-edges of T that it crosses. Combinatorial and
// exact; see overlay_coordinates.h.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/intrinsic/overlay/overlay_coordinates.h"

namespace flipfree::intrinsic {

// Where a half-edge g of M0 leaves its source vertex in T.
//   shared: g is the half-edge h of T;
//   else:   g starts in the corner at the source of h, between h and the half-edge after it
//   counter-clockwise, as the
//           place-th such curve.
struct CurveStart {
  HalfedgeId halfedge = kInvalid;
  std::int32_t place = -1;  // -1 = shared
  bool shared() const { return place < 0; }
};

// A curve of M0 leaves a face of T through half-edge `through` (a half-edge of that face).
struct Crossing {
  HalfedgeId through = kInvalid;
  // Among all curves that cross this edge, counted from the source of its even half-edge.
  std::int64_t position = 0;
};

struct OverlayTrace {
  std::vector<CurveStart> start;   // #H of M0: for every half-edge of M0
  std::vector<HalfedgeId> curves;  // the traced half-edges of M0
  std::vector<std::int64_t>
      begin;  // #curves + 1: crossings of curve c are begin[c] .. begin[c + 1], in order
  std::vector<Crossing> crossings;
  std::span<const Crossing> of_curve(std::size_t c) const {
    return {crossings.data() + begin[c], static_cast<std::size_t>(begin[c + 1] - begin[c])};
  }
};

// Follows the half-edges `curves` of M0 through T. Throws NotConverged/kIterationLimit if they have
// more than `max_crossings` crossings together (the refinement would not fit anywhere),
// InternalError if a curve does not end where it should. Cost: O(#H + crossings).
OverlayTrace trace_overlay(const OverlayCoordinates& coordinates, std::vector<HalfedgeId> curves,
                           std::int64_t max_crossings, const ExecutionContext& context);

}  // namespace flipfree::intrinsic
