#include "flipfree/conformal/map/map.h"

#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include "flipfree/base/failure/give_up.h"
#include "flipfree/base/failure/in_time.h"
#include "flipfree/base/parallel.h"
#include "flipfree/base/tolerances.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/certify/certify.h"
#include "flipfree/conformal/map/map_failure.h"
#include "flipfree/conformal/map/stored_map.h"
#include "flipfree/intrinsic/layout/layout.h"
#include "flipfree/intrinsic/overlay/overlay_spread.h"
#include "flipfree/mesh/cut_graph/cut.h"
#include "flipfree/mesh/cut_graph/map_cut.h"
#include "flipfree/mesh/validate.h"

namespace flipfree::conformal {
namespace {

struct Prescribed {
  std::vector<VertexId> cones;  // interior vertices that are not flat
  certify::CertifyRequest
      request;  // what is certified: cones, and boundary angles that are not free
};

Prescribed prescribed_angles(const std::vector<double>& target_angles,
                             const std::vector<bool>& on_boundary, double flat_tolerance) {
  Prescribed out;
  for (std::size_t v = 0; v < target_angles.size(); ++v) {
    const auto id = static_cast<VertexId>(v);
    const bool cone =
        !on_boundary[v] && std::abs(target_angles[v] - 2 * std::numbers::pi) > flat_tolerance;
    if (cone) out.cones.push_back(id);
    if (cone || (on_boundary[v] && target_angles[v] > 0))
      out.request.cone_angles.emplace_back(id, target_angles[v]);
  }
  return out;
}

void write_figures(const intrinsic::MetricOverlay& overlaid, const intrinsic::MetricLayout& layout,
                   Stats& stats) {
  const intrinsic::Overlay& overlay = overlaid.overlay;
  stats["overlay_crossings"] = static_cast<std::int64_t>(overlay.trace.crossings.size());
  stats["straightened_crossings"] = static_cast<std::int64_t>(overlay.straightened.moved);
  stats["bent_crossings"] = static_cast<std::int64_t>(overlay.straightened.kept);
  stats["largest_straightening"] = overlay.straightened.largest_move;
  stats["origin_moved"] = static_cast<std::int64_t>(layout.origin_moves);
  stats["charts"] = static_cast<std::int64_t>(layout.chart_count);
  stats["closing_error"] = layout.closing_error;
  stats["seconds_layout"] = layout.seconds_layout;
  stats["seconds_refine"] = layout.seconds_refine;
}

// Why the map cannot be used, if it cannot.
void judge(const std::vector<FaceId>& too_small, intrinsic::Refinement refinement,
           const ConformalMetric& metric, ConformalMapResult& result) {
  certify::Parametrization& map = result.map;
  if (!too_small.empty()) {
    result.failure = refinement == intrinsic::Refinement::kNever ? needs_refinement(too_small)
                                                                 : not_storable(metric, too_small);
  } else if (!map.certificate.ok) {
    result.failure = not_certified(metric, certify::in_input_faces(map));
  }
  if (result.failure && map.certificate.ok) {
    // Positive triangles everywhere, but only because rounding bent the cones.
    map.certificate.ok = false;
    map.certificate.failures.push_back(
        "G5: the stored 32-bit values differ from a prescribed angle by " +
        scientific(std::get<double>(map.stats["stored_angle_error"])) + " radians");
  }
}

// Among needles the curves of many edges are pressed together until nothing can be stored. Replaces
// a failure by the map of the refined start if that has none.
void try_refined_start(const mesh::Surface& surface, const Points3* lengths,
                       const std::vector<double>& target_angles, const ConformalMapOptions& options,
                       ConformalMapResult& result, ExecutionContext& context) {
  MetricOptions metric = options.metric;
  metric.require_convergence = false;
  auto solved = refined_metric(surface, lengths, target_angles, metric, context);
  if (!solved || !solved->metric.converged) return;
  ConformalMapResult again =
      map_from_metric(surface, target_angles, std::move(*solved), options, context);
  if (!again.failure) result = std::move(again);
}

// The map, its metric left in `solved`.
ConformalMapResult map_of(const mesh::Surface& surface, const std::vector<double>& target_angles,
                          const RefinedMetric& solved, const ConformalMapOptions& options,
                          ExecutionContext& context) {
  const auto vertex_count = static_cast<Index>(surface.vertices.rows());
  const mesh::Adjacency adjacency = mesh::build_adjacency(vertex_count, surface.faces);
  const mesh::EdgeFlags given = mesh::flag_edges(surface.faces, adjacency, options.cuts);
  const mesh::EdgeFlags avoided =
      options.uncuttable.rows() == 0
          ? mesh::EdgeFlags{}
          : mesh::flag_edges(surface.faces, adjacency, options.uncuttable);
  const Prescribed prescribed =
      prescribed_angles(target_angles, solved.metric.on_boundary, options.flat_tolerance);

  ConformalMapResult result;
  certify::Parametrization& map = result.map;
  const Stopwatch whole;
  Stopwatch watch;
  const auto lap = [&](const char* name) {
    map.stats[name] = watch.seconds();
    watch.restart();
  };
  context.report("overlay", 0.0);
  // The cut asks for the cones only, the overlay for the metric only.
  mesh::EdgeFlags cuts;
  Outcome<intrinsic::MetricOverlay> overlay = attempt([&] {
    std::optional<intrinsic::MetricOverlay> made;
    parallel_for(context, 2, 1, [&](std::size_t task, std::size_t, std::size_t) {
      if (task == 0) {
        made = intrinsic::overlay_metric(solved.metric, solved.split.get(), adjacency,
                                         options.max_crossings, context);
      } else {
        cuts = mesh::cut_to_disks(surface, adjacency, given, prescribed.cones, avoided, context);
      }
    });
    return std::move(*made);
  });
  if (!overlay) {
    result.failure = overlay.error();
    return result;
  }
  lap("seconds_overlay");
  intrinsic::MetricLayout layout;
  {
    const ProgressRange range(context, 0.3, 0.8);
    const auto lay_out = [&] {
      layout = intrinsic::lay_out_metric(surface, adjacency, *overlay, cuts, options.refinement,
                                         context);
    };
    lay_out();
    if (options.spread > 0.0 && !layout.map.invalid.empty()) {
      map.stats["spread_faces"] = static_cast<std::int64_t>(layout.map.invalid.size());
      intrinsic::spread_crossings(overlay->overlay.trace, options.spread,
                                  overlay->overlay.positions);
      lay_out();
    }
  }
  watch.restart();
  context.report("certificate", 0.8);
  write_figures(*overlay, layout, map.stats);
  const auto& wanted = prescribed.request.cone_angles;
  const bool in_64_bits = layout.map.invalid.empty();
  take_map(layout, map);
  if (!layout.too_small.empty() && options.refinement != intrinsic::Refinement::kNever &&
      in_64_bits && repair_rounding(map, context) &&
      stored_angle_error(map, wanted) < kStoredAngleTolerance) {
    layout.too_small.clear();
  }
  lap("seconds_round");
  certify::CertifyRequest request = prescribed.request;
  request.require_distortion = options.positions_are_metric;
  certify::certify_map(map, surface, request, context);
  map.stats["stored_angle_error"] = stored_angle_error(map, wanted);
  lap("seconds_certify");
  map.stats["added_vertices"] =
      static_cast<std::int64_t>(map.surface.vertices.rows()) - vertex_count;
  map.stats["cones"] = static_cast<std::int64_t>(prescribed.cones.size());
  map.stats["intrinsic_refinement"] = static_cast<std::int64_t>(solved.metric.added.size());
  map.stats["energy"] = map.certificate.energy;
  judge(layout.too_small, options.refinement, solved.metric, result);
  map.stats["seconds_map"] = whole.seconds();
  context.report("certificate", 1.0);
  return result;
}

}  // namespace

ConformalMapResult map_from_metric(const mesh::Surface& surface,
                                   const std::vector<double>& target_angles, RefinedMetric solved,
                                   const ConformalMapOptions& options, ExecutionContext& context) {
  ConformalMapResult result;
  const bool in_time =
      ended_in_time([&] { result = map_of(surface, target_angles, solved, options, context); });
  if (!in_time) {
    // The limit of the metric is one of the whole map; the metric was found in time.
    if (!(options.metric.max_seconds > 0.0)) throw TimeIsOver();
    result = {};
    result.failure = out_of_time(solved.metric);
  }
  result.metric = std::move(solved.metric);
  return result;
}

namespace {

// As conformal_map, within the limit of `context`.
ConformalMapResult map_in_time(const mesh::Surface& surface, const Points3* lengths,
                               const std::vector<double>& target_angles,
                               const ConformalMapOptions& options, ExecutionContext& context) {
  if (options.cuts.rows() > 0) {
    // Complain about cuts before the work, not after.
    mesh::validate(surface, {}, context);
    mesh::flag_edges(
        surface.faces,
        mesh::build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces),
        options.cuts);
  }
  const StartRefinement wish = options.intrinsic_refinement;
  RefinedMetric solved;
  {
    const ProgressRange range(context, 0.0, 0.6);
    solved = compute_refined_metric(surface, lengths, target_angles, options.metric, wish, context);
  }
  const bool refined = solved.split != nullptr;
  ConformalMapResult result;
  {
    const ProgressRange range(context, 0.6, refined ? 1.0 : 0.8);
    result = map_from_metric(surface, target_angles, std::move(solved), options, context);
  }
  if (result.failure && !refined && wish == StartRefinement::kAuto &&
      options.refinement != intrinsic::Refinement::kNever) {
    const ProgressRange range(context, 0.8, 1.0);
    // Where the second way fails as well, the failure of the first one stays.
    const bool in_time = ended_in_time([&] {
      failure_of(
          [&] { try_refined_start(surface, lengths, target_angles, options, result, context); });
    });
    if (!in_time && !(options.metric.max_seconds > 0.0)) throw TimeIsOver();
  }
  return result;
}

}  // namespace

ConformalMapResult conformal_map(const mesh::Surface& surface, const Points3* lengths,
                                 const std::vector<double>& target_angles,
                                 const ConformalMapOptions& options, ExecutionContext& context) {
  return in_time(context, options.metric.max_seconds, "The conformal map was not reached",
                 "or spread the curvature over more vertices", [&] {
                   ConformalMapOptions own = options;
                   own.positions_are_metric = options.positions_are_metric && lengths == nullptr;
                   return map_in_time(surface, lengths, target_angles, own, context);
                 });
}

}  // namespace flipfree::conformal
