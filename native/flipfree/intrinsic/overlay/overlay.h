// How the edges of the input triangulation run over the final one of a metric: exact in how they
// cross (overlay_coordinates.h, overlay_trace.h), and where, in doubles (overlay_positions.h,
// overlay_straight.h).
#pragma once

#include <cstdint>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/intrinsic/flipped_metric.h"
#include "flipfree/intrinsic/overlay/overlay_coordinates.h"
#include "flipfree/intrinsic/overlay/overlay_positions.h"
#include "flipfree/intrinsic/overlay/overlay_straight.h"
#include "flipfree/intrinsic/overlay/overlay_trace.h"

namespace flipfree::intrinsic {

struct Overlay {
  OverlayCoordinates coordinates;
  OverlayTrace trace;
  OverlayPositions positions;
  Straightened straightened;
};

// `curves`: half-edges of metric.initial, one per edge at most. Throws NotConverged/kIterationLimit
// as trace_overlay(), InternalError if the flips do not lead to metric.mesh. Cost: O(#F + flips +
// crossings).
Overlay build_overlay(const FlippedMetric& metric, const std::vector<HalfedgeId>& curves,
                      std::int64_t max_crossings, const ExecutionContext& context);

}  // namespace flipfree::intrinsic
