#include "flipfree/intrinsic/overlay/overlay.h"

#include <optional>

#include "flipfree/base/debug_check.h"
#include "flipfree/base/error.h"
#include "flipfree/base/parallel.h"

namespace flipfree::intrinsic {

Overlay build_overlay(const FlippedMetric& metric, const std::vector<HalfedgeId>& curves,
                      std::int64_t max_crossings, const ExecutionContext& context) {
  debug_check("build_overlay", [&] { return find_broken_invariant(metric); });
  Overlay overlay{OverlayCoordinates(metric.initial), {}, {}, {}};
  const auto replay = [&](std::size_t from, std::size_t to) {
    replay_flips(metric.flips, from, to, context,
                 [&](EdgeId e) { overlay.coordinates.flip(FlipMesh::halfedge(e)); });
  };
  replay(0, metric.euclidean_flips);
  std::optional<OverlayCoordinates> start;
  if (metric.euclidean_flips > 0) start = overlay.coordinates;
  replay(metric.euclidean_flips, metric.flips.size());
  if (overlay.coordinates.current().next != metric.mesh.next) {
    throw InternalError("overlay: the recorded flips do not lead to the final triangulation");
  }
  const std::vector<long double> u = widened(metric.u);
  std::vector<long double> scale;
  scale.reserve(metric.mesh.unknown.size());
  for (const VertexId v : metric.mesh.unknown) scale.push_back(u[static_cast<std::size_t>(v)]);
  StraightCurves straight;
  parallel_for(context, 2, 1, [&](std::size_t task, std::size_t, std::size_t) {
    if (task == 0) {
      overlay.trace = trace_overlay(overlay.coordinates, curves, max_crossings, context);
      overlay.positions = locate_crossings(overlay.coordinates, overlay.trace,
                                           widened(metric.length), scale, context);
    } else if (start) {
      straight = follow_straight(metric, *start, curves, widened(metric.initial_length), context);
    }
  });
  overlay.straightened =
      straighten(metric, overlay.trace, straight, scale, overlay.positions, context);
  return overlay;
}

}  // namespace flipfree::intrinsic
