// From a metric to a map: the surface with UVs, refined where its own triangles would flip.
//
// overlay_metric() lays the input's edges over the final triangulation, lay_out_metric() develops
// both in the plane along a cut, and writes the result on as few triangles as it can, so that all
// of them are positive as stored. Who found the metric does not matter: all that is read is a
// FlippedMetric, flat but for cones on the cut.
#pragma once

#include <cstdint>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/intrinsic/flipped_metric.h"
#include "flipfree/intrinsic/layout/development.h"
#include "flipfree/intrinsic/layout/refine_map.h"
#include "flipfree/intrinsic/overlay.h"
#include "flipfree/intrinsic/refined_start/split_surface.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::intrinsic {

inline constexpr std::int64_t kMaxCrossings = 20'000'000;

// A metric with its overlay.
struct MetricOverlay {
  const FlippedMetric* metric = nullptr;
  const SplitSurface* split = nullptr;  // the refined start that the metric was computed on, if any
  // Of the triangulation that the metric was computed on.
  mesh::Adjacency adjacency;
  InputEdges edges;
  Overlay overlay;  // of all its edges
};
// `adjacency`: of the input. `metric` and `split` must outlive the result. Errors, cost:
// build_overlay().
MetricOverlay overlay_metric(const FlippedMetric& metric, const SplitSurface* split,
                             const mesh::Adjacency& adjacency, std::int64_t max_crossings,
                             const ExecutionContext& context);

struct MetricLayout {
  RefinedLayout map;
  IndexPairs cut_edges;  // of map.surface
  // Input faces that 32 bits cannot hold; the map is then valid in 64 bits at best (map.invalid).
  std::vector<FaceId> too_small;
  Index chart_count = 0;
  double closing_error = 0.0;  // development.h
  int origin_moves = 0;        // for the finest places to be stored
  double seconds_layout = 0.0;
  double seconds_refine = 0.0;
};
// `cuts`: edges of the input, which with the boundary leave disks, cones on their boundaries. The
// map fills the unit square, charts side by side. Reports "layout" and "refinement". Cost: O(#F +
// crossings) and that of refine_map().
MetricLayout lay_out_metric(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                            const MetricOverlay& overlaid, const mesh::EdgeFlags& cuts,
                            Refinement refinement, ExecutionContext& context);

// Where the charts of a layout lie in the unit square.

// Turns every chart so that its longest boundary edge is horizontal, sets charts side by side, and
// scales the whole into the unit square.
struct ChartPlacement {
  std::vector<Place> direction;  // per chart: unit complex number by which it is turned
  std::vector<Place> shift;      // per chart, added after turning
  long double scale = 1;
  Place origin;  // subtracted last but one, before scaling
  Vector2 apply(const Place& p, Index chart) const {
    const Place& d = direction[static_cast<std::size_t>(chart)];
    const Place& s = shift[static_cast<std::size_t>(chart)];
    const long double x = p.x * d.x - p.y * d.y + s.x - origin.x;
    const long double y = p.x * d.y + p.y * d.x + s.y - origin.y;
    return {static_cast<double>(x * scale), static_cast<double>(y * scale)};
  }
};

ChartPlacement place_charts(const Development& development, const mesh::Adjacency& adjacency,
                            const ExecutionContext& context);

}  // namespace flipfree::intrinsic
