#include "flipfree/conformal/map.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include "flipfree/base/failure.h"
#include "flipfree/base/parallel.h"
#include "flipfree/base/plane.h"
#include "flipfree/base/tolerances.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/certify/certify.h"
#include "flipfree/distortion/rounding.h"
#include "flipfree/distortion/seams/seams.h"
#include "flipfree/intrinsic/layout/layout.h"
#include "flipfree/intrinsic/overlay.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/cut_graph.h"
#include "flipfree/mesh/validate.h"

namespace flipfree::conformal {

namespace {

std::string scientific(double x) { return number_text(x, 3); }

// `what` is wrong with the map of a metric that is there.
std::string only_the_metric(const ConformalMetric& metric, const std::string& what) {
  return "The metric is computed (largest angle error " + scientific(metric.angle_error) +
         "), but its scale factors span a factor of " + scientific(std::exp(metric.scale_range)) +
         ", " + what +
         ". Spread the curvature over more cones (suggest_cones), add cuts, or use the metric as "
         "it is.";
}

Error not_storable(const ConformalMetric& metric, const std::vector<FaceId>& faces) {
  return {ErrorCode::kRoundingFlips,
          only_the_metric(metric,
                          "so " + std::to_string(faces.size()) +
                              " input faces are too small in the map for 32-bit UVs, first face " +
                              face_id(faces[0])),
          ElementKind::kFace, first_elements(faces)};
}

Error not_certified(const ConformalMetric& metric, const certify::Certificate& certificate) {
  return {ErrorCode::kCertificateFailed,
          only_the_metric(
              metric, "and the map did not pass its certificate: " + certificate.failures.front()),
          ElementKind::kFace, certificate.failed_faces};
}

Error needs_refinement(const std::vector<FaceId>& faces) {
  return {ErrorCode::kCertificateFailed,
          "On the original triangles " + std::to_string(faces.size()) +
              " faces would flip, first face " + face_id(faces[0]) +
              ". Allow points to be added (original_triangles=\"auto\").",
          ElementKind::kFace, first_elements(faces)};
}

// A map that is valid in 64 bits, rounded to other 32-bit points than the nearest where these would
// flip a triangle. False, and the map unchanged, if there are none.
bool repair_rounding(certify::Parametrization& map, ExecutionContext& context) {
  const mesh::Adjacency& adjacency = map.surface.adjacency();
  const distortion::CutMap cut =
      distortion::cut_map(map.surface, adjacency, mesh::uv_cuts(adjacency, map.uv), map.uv);
  Outcome<Points2f> stored = attempt([&] {
    return distortion::round_to_storage(cut.surface.faces, cut.uv, {}, context, map.stats);
  });
  if (stored) map.uv32 = distortion::corners_of(cut, stored->cast<double>()).cast<float>();
  return static_cast<bool>(stored);
}

// Largest difference, over the vertices with a prescribed angle, between that angle and the one of
// the stored values.
double stored_angle_error(const certify::Parametrization& map,
                          const std::vector<std::pair<VertexId, double>>& prescribed) {
  std::vector<double> sum(static_cast<std::size_t>(map.surface.vertices.rows()), 0.0);
  std::vector<char> asked(sum.size(), 0);
  for (const auto& [v, angle] : prescribed) asked[at(v)] = 1;
  for (CornerId c = 0; c < static_cast<CornerId>(map.uv32.rows()); ++c) {
    if (asked[at(map.surface.faces(c / 3, c % 3))] == 0) continue;
    const Vector2 p = map.uv32.row(c).cast<double>();
    const Vector2 a = map.uv32.row(next_corner(c)).cast<double>().transpose() - p;
    const Vector2 b = map.uv32.row(previous_corner(c)).cast<double>().transpose() - p;
    sum[at(map.surface.faces(c / 3, c % 3))] += turn(a, b);
  }
  double largest = 0.0;
  for (const auto& [v, angle] : prescribed)
    largest = std::max(largest, std::abs(sum[at(v)] - angle));
  return largest;
}

// An interior vertex is a cone, and lies on a cut, if its target differs from 2 pi by more
// (radians).
constexpr double kFlatTolerance = 1e-8;

struct Prescribed {
  std::vector<VertexId> cones;  // interior vertices that are not flat
  certify::CertifyRequest
      request;  // what is certified: cones, and boundary angles that are not free
};

Prescribed prescribed_angles(const std::vector<double>& target_angles,
                             const std::vector<bool>& on_boundary) {
  Prescribed out;
  for (std::size_t v = 0; v < target_angles.size(); ++v) {
    const auto id = static_cast<VertexId>(v);
    const bool cone =
        !on_boundary[v] && std::abs(target_angles[v] - 2 * std::numbers::pi) > kFlatTolerance;
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
           const ConformalMetric& metric, double angle_error, ConformalMapResult& result) {
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
        scientific(angle_error) + " radians");
  }
}

// The map, its metric left in `solved`.
ConformalMapResult map_of(const mesh::Surface& surface, const std::vector<double>& target_angles,
                          const RefinedMetric& solved, const ConformalMapOptions& options,
                          ExecutionContext& context) {
  const auto vertex_count = static_cast<Index>(surface.vertices.rows());
  const mesh::Adjacency& adjacency = surface.adjacency();
  const mesh::EdgeFlags given = mesh::flag_edges(surface.faces, adjacency, options.cuts);
  const mesh::EdgeFlags avoided =
      options.uncuttable.rows() == 0
          ? mesh::EdgeFlags{}
          : mesh::flag_edges(surface.faces, adjacency, options.uncuttable);
  const Prescribed prescribed = prescribed_angles(target_angles, solved.metric.on_boundary);

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
        made = intrinsic::overlay_metric(solved.metric, solved.split.get(), surface, context);
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
    intrinsic::Refinement refinement = options.refinement;
    const auto lay_out = [&] {
      layout = intrinsic::lay_out_metric(surface, *overlay, cuts, refinement, context);
    };
    lay_out();
    if (options.spread > 0.0 && !layout.map.invalid.empty()) {
      map.stats["spread_faces"] = static_cast<std::int64_t>(layout.map.invalid.size());
      intrinsic::spread_crossings(options.spread, overlay->overlay.trace);
      lay_out();
    } else if (refinement == intrinsic::Refinement::kAuto && !layout.map.invalid.empty()) {
      refinement = intrinsic::Refinement::kClosely;
      lay_out();
    }
  }
  watch.restart();
  context.report("certificate", 0.8);
  write_figures(*overlay, layout, map.stats);
  const auto& wanted = prescribed.request.cone_angles;
  const bool in_64_bits = layout.map.invalid.empty();
  take_map(layout.map, map);
  if (solved.split == nullptr) {
    result.log_weight.resize(static_cast<std::size_t>(map.surface.vertices.rows()));
    for (std::size_t v = 0; v < at(vertex_count); ++v)
      result.log_weight[v] = -solved.metric.scale_factors[v];
    const std::vector<Index>& edge_vertex = layout.map.edge_vertex;
    for (std::size_t i = 0; i < edge_vertex.size(); ++i) {
      if (edge_vertex[i] != kInvalid)
        result.log_weight[at(edge_vertex[i])] = overlay->overlay.trace.crossings[i].log_weight;
    }
  }
  map.cut_edges = std::move(layout.cut_edges);
  if (!layout.too_small.empty() && options.refinement != intrinsic::Refinement::kNever &&
      in_64_bits && repair_rounding(map, context) &&
      stored_angle_error(map, wanted) < kStoredAngleTolerance) {
    layout.too_small.clear();
  }
  lap("seconds_round");
  certify::CertifyRequest request = prescribed.request;
  request.require_distortion = options.positions_are_metric;
  certify::certify_map(map, surface, request, context);
  const double angle_error = stored_angle_error(map, wanted);
  map.stats["stored_angle_error"] = angle_error;
  lap("seconds_certify");
  map.stats["added_vertices"] =
      static_cast<std::int64_t>(map.surface.vertices.rows()) - vertex_count;
  map.stats["cones"] = static_cast<std::int64_t>(prescribed.cones.size());
  map.stats["intrinsic_refinement"] = static_cast<std::int64_t>(solved.metric.added.size());
  map.stats["energy"] = map.certificate.energy;
  judge(layout.too_small, options.refinement, solved.metric, angle_error, result);
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
    result.failure =
        out_of_time("The metric is computed (largest angle error " +
                        scientific(solved.metric.angle_error) + "), but no map was laid out",
                    options.metric.max_seconds, "or use the metric as it is");
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
    mesh::flag_edges(surface.faces, surface.adjacency(), options.cuts);
  }
  RefinedMetric solved;
  {
    const ProgressRange range(context, 0.0, 0.6);
    solved = compute_refined_metric(surface, lengths, target_angles, options.metric,
                                    options.refined_start, context);
  }
  const ProgressRange range(context, 0.6, 1.0);
  return map_from_metric(surface, target_angles, std::move(solved), options, context);
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

void take_map(intrinsic::RefinedLayout& refined, certify::Parametrization& map) {
  map.surface = std::move(refined.surface);
  map.uv = std::move(refined.uv);
  map.uv32 = map.uv.cast<float>();
  map.parent_face = std::move(refined.provenance.face);
  const std::vector<mesh::SurfacePoint>& where = refined.provenance.vertex;
  map.vertex_parent.resize(where.size());
  map.vertex_barycentric.resize(static_cast<Eigen::Index>(where.size()), 3);
  for (std::size_t v = 0; v < where.size(); ++v) {
    map.vertex_parent[v] = where[v].face;
    map.vertex_barycentric.row(static_cast<Eigen::Index>(v)) = where[v].weight;
  }
}

}  // namespace flipfree::conformal
