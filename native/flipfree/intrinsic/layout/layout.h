// From a metric to a map: the surface with UVs, refined where its own triangles
// would flip.
//
// overlay_metric() lays the input's edges over the final triangulation,
// lay_out_metric() develops both in the plane along a cut, and writes the
// result on as few triangles as it can, so that all of them are positive as
// stored. Who found the metric does not matter: all that is read is a
// FlippedMetric, flat but for cones on the cut.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/intrinsic/flipped_metric.h"
#include "flipfree/intrinsic/layout/refine_map.h"
#include "flipfree/intrinsic/overlay.h"
#include "flipfree/intrinsic/refined_start/split_surface.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/surface.h"

namespace flipfree::intrinsic {

// A metric with its overlay.
struct MetricOverlay {
  const FlippedMetric* metric = nullptr;
  const SplitSurface* split = nullptr;  // the refined start that the metric was computed on, if any
  // Of the triangulation that the metric was computed on.
  mesh::Adjacency adjacency;
  InputEdges edges;
  Overlay overlay;  // of all its edges
};
// `surface`: the input. `metric` and `split` must outlive the result. Errors, cost:
// build_overlay().
MetricOverlay overlay_metric(const FlippedMetric& metric, const SplitSurface* split,
                             const mesh::Surface& surface, const ExecutionContext& context);

struct MetricLayout {
  RefinedLayout map;
  IndexPairs cut_edges;  // of map.surface
  // Input faces that 32 bits cannot hold; the map is then valid in 64 bits at
  // best (map.invalid).
  std::vector<FaceId> too_small;
  Index chart_count = 0;
  // Largest distance between two developments of one place, over the largest developed edge.
  double closing_error = 0.0;
  int origin_moves = 0;  // for the finest places to be stored
  double seconds_layout = 0.0;
  double seconds_refine = 0.0;
};
// `cuts`: edges of the input, which with the boundary leave disks, cones on
// their boundaries. The map fills the unit square, charts side by side. Reports
// "layout" and "refinement". Cost: O(#F + crossings) and that of refine_map().
MetricLayout lay_out_metric(const mesh::Surface& surface, const MetricOverlay& overlaid,
                            const mesh::EdgeFlags& cuts, Refinement refinement,
                            ExecutionContext& context);

}  // namespace flipfree::intrinsic
