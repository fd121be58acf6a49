#include "flipfree/unwrap/chart.h"

#include <algorithm>
#include <string>

#include "flipfree/base/error.h"
#include "flipfree/certify/certify.h"
#include "flipfree/distortion/conformal_start.h"
#include "flipfree/distortion/minimize.h"
#include "flipfree/distortion/targets.h"
#include "flipfree/embedding/boundary.h"
#include "flipfree/embedding/embed.h"
#include "flipfree/mesh/fill.h"
#include "flipfree/mesh/topology.h"
#include "flipfree/unwrap/layout.h"

namespace flipfree {
namespace {

using Loop = std::vector<HalfedgeId>;

std::vector<double> edge_lengths(const Surface& chart, const Loop& loop) {
  std::vector<double> lengths;
  lengths.reserve(loop.size());
  for (const HalfedgeId h : loop) {
    lengths.push_back(
        (chart.vertices.row(source(chart.faces, h)) - chart.vertices.row(target(chart.faces, h)))
            .norm());
  }
  return lengths;
}

// The longest loop becomes the outer boundary; it is moved to the front.
std::vector<Loop> outer_loop_first(const Surface& chart, std::vector<Loop> loops) {
  std::size_t outer = 0;
  double longest = -1.0;
  for (std::size_t i = 0; i < loops.size(); ++i) {
    double length = 0.0;
    for (const double l : edge_lengths(chart, loops[i])) length += l;
    if (length > longest) {
      longest = length;
      outer = i;
    }
  }
  std::swap(loops[0], loops[outer]);
  return loops;
}

// A flip-free start: holes filled virtually, the outer loop on a circle.
Points2 embed_on_circle(const Surface& chart, ExecutionContext& context, Stats& stats) {
  const auto vertex_count = static_cast<Index>(chart.vertices.rows());
  const Adjacency adjacency = build_adjacency(vertex_count, chart.faces);
  const std::vector<Loop> loops =
      outer_loop_first(chart, boundary_halfedge_loops(chart.faces, adjacency));
  const FilledSurface filled = fill_holes(chart, {loops.begin() + 1, loops.end()});
  std::vector<VertexId> rim;
  rim.reserve(loops[0].size());
  for (const HalfedgeId h : loops[0]) rim.push_back(source(chart.faces, h));
  const BoundaryPlacement placement =
      place_boundary(BoundaryShape::kCircle, edge_lengths(chart, loops[0]));
  // The optimiser starts from 64 bits; only its result is rounded.
  EmbedOptions options;
  options.float32 = false;
  options.low_distortion = true;  // where Tutte fails: a start the optimiser can open
  const Points2 uv =
      embed_disk(filled.surface.faces, static_cast<Index>(filled.surface.vertices.rows()), rim,
                 placement.positions, options, context, stats);
  return uv.topRows(vertex_count);
}

// The conformal map if it is flip-free and one-to-one, by exact test, and less distorted than the
// map on the circle; the optimiser then needs about half the iterations.
Points2 better_start(const Surface& chart, Points2 circle, ExecutionContext& context,
                     Stats& stats) {
  context.report("conformal start", 0.0);
  const Points2 conformal = spectral_conformal_map(chart, circle, context);
  if (conformal.rows() == 0) return circle;
  CertifyRequest request;
  const auto measure = [&](const Points2& uv) {
    Points2 corners(3 * chart.faces.rows(), 2);
    for (CornerId c = 0; c < corners.rows(); ++c)
      corners.row(c) = uv.row(chart.faces(c / 3, c % 3));
    request.surface = &chart;
    request.uv = &corners;
    return certify(request, context);
  };
  const Certificate found = measure(conformal);
  const bool usable = found.flips64 == 0 && found.winding_failures <= 0 && found.overlaps <= 0;
  stats["conformal_start.energy"] = found.energy;
  stats["conformal_start.usable"] = static_cast<std::int64_t>(usable);
  return usable && found.energy < measure(circle).energy ? conformal : circle;
}

void apply(const Similarity& similarity, Points2& uv) {
  for (Eigen::Index i = 0; i < uv.rows(); ++i)
    uv.row(i) = similarity(uv.row(i).transpose()).transpose();
}

// The best placement of the free map with respect to its pins; one pin only moves it.
Similarity place_by_pins(const Points2& uv, const std::vector<std::pair<VertexId, Vector2>>& pins) {
  const auto count = static_cast<Eigen::Index>(pins.size());
  Points2 from(count, 2);
  Points2 to(count, 2);
  for (Eigen::Index i = 0; i < count; ++i) {
    from.row(i) = uv.row(pins[static_cast<std::size_t>(i)].first);
    to.row(i) = pins[static_cast<std::size_t>(i)].second.transpose();
  }
  return fit_similarity(from, to);
}

void reject_coincident_pins(const std::vector<std::pair<VertexId, Vector2>>& pins) {
  std::vector<std::pair<VertexId, Vector2>> sorted = pins;
  std::sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) {
    return a.second.x() != b.second.x() ? a.second.x() < b.second.x() : a.second.y() < b.second.y();
  });
  for (std::size_t i = 1; i < sorted.size(); ++i) {
    if (sorted[i].second != sorted[i - 1].second) continue;
    throw_infeasible(ErrorCode::kContradictoryPins,
                     "Two vertices of one chart are pinned to the same point (" +
                         std::to_string(sorted[i].second.x()) + ", " +
                         std::to_string(sorted[i].second.y()) +
                         "). Unpin one of them or move its pin.",
                     ElementKind::kVertex, {sorted[i - 1].first, sorted[i].first});
  }
}

MinimizeOptions minimize_options(const FlattenOptions& options) {
  MinimizeOptions minimize;
  minimize.max_iterations = options.max_iterations;
  minimize.tolerance = options.tolerance;
  minimize.bijective = options.bijective;
  return minimize;
}

// Of a chart without pins, as far as time allows.
void lower_distortion(const Surface& chart, const FlattenOptions& options, Points2& uv,
                      ExecutionContext& context, Stats& stats) try {
  {
    const ProgressRange range(context, 0.2, 0.3);
    uv = better_start(chart, uv, context, stats);
  }
  const ProgressRange range(context, 0.3, 1.0);
  uv = minimize_distortion(chart, uv, minimize_options(options), context, stats);
  if (context.time_is_over()) stats["time_limit_reached"] = std::int64_t{1};
} catch (const TimeIsOver&) {
  stats["time_limit_reached"] = std::int64_t{1};
}

}  // namespace

Points2 flatten_chart(const Surface& chart, const FlattenOptions& options,
                      ExecutionContext& context, Stats& stats) {
  reject_coincident_pins(options.pins);
  Points2 uv;
  {
    const ProgressRange range(context, 0.0, 0.2);
    uv = embed_on_circle(chart, context, stats);
  }
  // From here on there is a map: without pins, less time only leaves it more distorted.
  if (options.pins.empty()) {
    lower_distortion(chart, options, uv, context, stats);
    return uv;
  }
  {
    const ProgressRange range(context, 0.2, 0.3);
    uv = better_start(chart, uv, context, stats);
  }
  const MinimizeOptions minimize = minimize_options(options);
  {
    const ProgressRange range(context, 0.3, 0.6);
    uv = minimize_distortion(chart, uv, minimize, context, stats);
  }
  // The free map, put where the pins want it, is the start from which they are pulled to their
  // places.
  apply(place_by_pins(uv, options.pins), uv);
  const ProgressRange range(context, 0.6, 1.0);
  TargetsResult result = minimize_with_targets(chart, uv, options.pins, minimize, context, stats);
  if (context.time_is_over()) stats["time_limit_reached"] = std::int64_t{1};
  if (!result.missed.empty()) {
    throw_not_converged(
        ErrorCode::kLineSearchStalled,
        std::to_string(result.missed.size()) + " of " + std::to_string(options.pins.size()) +
            " pins cannot be reached without folding this triangulation; the map came " +
            std::to_string(static_cast<int>(100.0 * result.fraction)) +
            " % of the way. Use Match Pins, which refines the mesh, or move or unpin them.",
        ElementKind::kVertex, result.missed);
  }
  return std::move(result.uv);
}

}  // namespace flipfree
