#include "flipfree/conformal/map/map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include "flipfree/base/in_time.h"
#include "flipfree/base/parallel.h"
#include "flipfree/base/plane.h"
#include "flipfree/base/tolerances.h"
#include "flipfree/certify/certified_map.h"
#include "flipfree/certify/certify.h"
#include "flipfree/conformal/map/map_failure.h"
#include "flipfree/distortion/rounding.h"
#include "flipfree/intrinsic/layout/layout.h"
#include "flipfree/intrinsic/layout/map_layout.h"
#include "flipfree/intrinsic/layout/map_placement.h"
#include "flipfree/intrinsic/overlay/overlay_coordinates.h"
#include "flipfree/intrinsic/overlay/overlay_positions.h"
#include "flipfree/intrinsic/overlay/overlay_straight.h"
#include "flipfree/intrinsic/overlay/overlay_trace.h"
#include "flipfree/mesh/cut_graph/cut.h"
#include "flipfree/mesh/cut_graph/map_cut.h"
#include "flipfree/mesh/validate.h"
#include "flipfree/numeric/scalar.h"

namespace flipfree::conformal {
namespace {

using intrinsic::Scalars;

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

std::vector<long double> widened(const Scalars& values) {
  return std::visit(
      [](const auto& v) {
        std::vector<long double> out;
        out.reserve(v.size());
        for (const auto& x : v) out.push_back(numeric::widen(x));
        return out;
      },
      values);
}

intrinsic::FlipMesh initial_mesh(const ConformalMetric& metric) {
  intrinsic::FlipMesh mesh;
  mesh.next = metric.initial.next;
  mesh.source = metric.initial.origin;
  mesh.vertex_count = static_cast<Index>(metric.initial.vertex_count());
  return mesh;
}

void replay(const ConformalMetric& metric, std::size_t from, std::size_t to,
            intrinsic::OverlayCoordinates& coordinates, const ExecutionContext& context) {
  for (std::size_t i = from; i < to; ++i) {
    if ((i & 0xffff) == 0xffff) context.check();
    const intrinsic::PlainFlips& plain = metric.flips[i].plain;
    for (int k = 0; k < plain.count; ++k) {
      coordinates.flip(
          intrinsic::IntrinsicMesh::halfedge(plain.edges[static_cast<std::size_t>(k)]));
    }
  }
}

// How the input's edges run over the final triangulation.
struct Overlay {
  intrinsic::OverlayCoordinates coordinates;
  intrinsic::OverlayTrace trace;
  intrinsic::OverlayPositions positions;
  intrinsic::Straightened straightened;
};

Overlay build_overlay(const ConformalMetric& metric, const intrinsic::InputEdges& edges,
                      std::int64_t max_crossings, const ExecutionContext& context) {
  Overlay overlay{intrinsic::OverlayCoordinates(initial_mesh(metric)), {}, {}, {}};
  replay(metric, 0, metric.euclidean_flips, overlay.coordinates, context);
  std::optional<intrinsic::OverlayCoordinates> start;
  if (metric.euclidean_flips > 0) start = overlay.coordinates;
  replay(metric, metric.euclidean_flips, metric.flips.size(), overlay.coordinates, context);
  if (overlay.coordinates.current().next != metric.mesh.next) {
    throw InternalError("overlay: the recorded flips do not lead to the final triangulation");
  }
  std::vector<HalfedgeId> curves;
  curves.reserve(edges.halfedge.size());
  for (const HalfedgeId h : edges.halfedge) curves.push_back(metric.input_halfedge[at(h)]);
  const std::vector<long double> u = widened(metric.u);
  std::vector<long double> scale;
  scale.reserve(metric.mesh.unknown.size());
  for (const VertexId v : metric.mesh.unknown) scale.push_back(u[at(v)]);
  intrinsic::StraightCurves straight;
  parallel_for(context, 2, 1, [&](std::size_t task, std::size_t, std::size_t) {
    if (task == 0) {
      overlay.trace = intrinsic::trace_overlay(overlay.coordinates, curves, max_crossings, context);
      overlay.positions = intrinsic::locate_crossings(overlay.coordinates, overlay.trace,
                                                      widened(metric.length), scale, context);
    } else if (start) {
      straight = intrinsic::follow_straight(metric, *start, curves, widened(metric.initial_length),
                                            context);
    }
  });
  overlay.straightened =
      intrinsic::straighten(metric, overlay.trace, straight, scale, overlay.positions, context);
  return overlay;
}

intrinsic::Layout lay_out_metric(const ConformalMetric& metric, const Overlay& overlay,
                                 const intrinsic::InputEdges& edges,
                                 const mesh::Adjacency& adjacency, const mesh::EdgeFlags& cuts,
                                 const ExecutionContext& context) {
  std::vector<Index> curve_of_edge(metric.initial.edge_count(), kInvalid);
  std::vector<char> cut(metric.initial.edge_count(), 0);
  for (std::size_t e = 0; e < edges.halfedge.size(); ++e) {
    const HalfedgeId h = edges.halfedge[e];
    const EdgeId own = intrinsic::IntrinsicMesh::edge(metric.input_halfedge[at(h)]);
    curve_of_edge[at(own)] = static_cast<Index>(e);
    cut[at(own)] = adjacency.opposite[at(h)] == kInvalid || cuts[at(h)];
  }
  const intrinsic::LayoutInput input{&overlay.coordinates,   &overlay.trace, &overlay.positions,
                                     &metric.input_halfedge, &curve_of_edge, &cut};
  return std::visit(
      [&](const auto& lengths) { return intrinsic::lay_out(input, lengths, context); },
      metric.length);
}

intrinsic::EdgePointMap to_edge_points(const intrinsic::MapLayout& developed,
                                       const intrinsic::ChartPlacement& placement,
                                       const intrinsic::InputEdges& edges,
                                       const mesh::Adjacency& adjacency,
                                       const ExecutionContext& context) {
  const intrinsic::Layout& layout = developed.layout;
  intrinsic::EdgePointMap map;
  map.edge_halfedge = edges.halfedge;
  map.edge_of = edges.of_corner;
  map.begin = developed.begin;
  const auto corner_count = static_cast<CornerId>(layout.corner.size());
  map.corner_angle = layout.corner_angle;
  map.corner_uv.resize(corner_count, 2);
  parallel_for(context, at(corner_count), 16384,
               [&](std::size_t begin, std::size_t end, std::size_t) {
                 for (auto c = static_cast<CornerId>(begin); c < static_cast<CornerId>(end); ++c) {
                   map.corner_uv.row(c) =
                       placement.apply(layout.corner[at(c)], layout.chart_of_face[at(c / 3)]);
                 }
               });
  map.points.resize(developed.along.size());
  for (std::size_t e = 0; e < edges.halfedge.size(); ++e) {
    const HalfedgeId other = adjacency.opposite[at(edges.halfedge[e])];
    const Index left = layout.chart_of_face[at(edges.halfedge[e] / 3)];
    const Index right = other == kInvalid ? left : layout.chart_of_face[at(other / 3)];
    for (std::int64_t i = map.begin[e]; i < map.begin[e + 1]; ++i) {
      const auto p = static_cast<std::size_t>(i);
      intrinsic::EdgePoint& point = map.points[p];
      point.along = developed.along[p];
      point.uv_left = placement.apply(layout.crossing[p][0], left);
      point.uv_right = placement.apply(layout.crossing[p][other == kInvalid ? 0 : 1], right);
    }
  }
  return map;
}

struct RoundedMap {
  intrinsic::RefinedLayout map;
  std::vector<FaceId>
      too_small;  // input faces that 32 bits cannot hold; the map is then valid in 64 bits at best
};

// The refinement with the fewest faces that cannot be stored: first in the unit square, then, where
// that is too coarse, with the origin moved to the finest place. If none can be stored in 32 bits,
// the best one for 64.
RoundedMap refine_and_round(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                            const intrinsic::MapLayout& developed,
                            const intrinsic::InputEdges& edges, intrinsic::Refinement refinement,
                            Stats& stats, const ExecutionContext& context) {
  constexpr int kOrigins = 3;
  const intrinsic::Layout& layout = developed.layout;
  intrinsic::ChartPlacement placement = intrinsic::place_charts(layout, adjacency, context);
  intrinsic::ChartPlacement best_placement = placement;
  RoundedMap best;
  for (int attempt = 0; attempt < kOrigins; ++attempt) {
    const intrinsic::EdgePointMap points =
        to_edge_points(developed, placement, edges, adjacency, context);
    intrinsic::RefinedLayout refined = intrinsic::refine_map(surface, adjacency, points, refinement,
                                                             intrinsic::Storage::k64And32, context);
    if (attempt == 0 || refined.invalid.size() < best.too_small.size()) {
      best.too_small = refined.invalid;
      best.map = std::move(refined);
      best_placement = placement;
      stats["origin_moved"] = std::int64_t{attempt};
    } else {
      break;
    }
    if (best.too_small.empty()) return best;
    placement.origin = intrinsic::finest_place(layout, placement, best.too_small);
  }
  const intrinsic::EdgePointMap points =
      to_edge_points(developed, best_placement, edges, adjacency, context);
  best.map = intrinsic::refine_map(surface, adjacency, points, refinement,
                                   intrinsic::Storage::k64Only, context);
  return best;
}

// A map that is valid in 64 bits, rounded to other 32-bit points than the nearest where these would
// flip a triangle. False if there are none.
bool repair_rounding(const certify::Parametrization& map, Points2f& uv32, Stats& stats,
                     ExecutionContext& context) {
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(map.surface.vertices.rows()), map.surface.faces);
  const mesh::CutMesh cut =
      mesh::cut_along(map.surface.faces, adjacency, mesh::uv_cuts(adjacency, map.uv));
  Points2 uv(static_cast<Eigen::Index>(cut.vertex_origin.size()), 2);
  for (Index c = 0; c < static_cast<Index>(map.uv.rows()); ++c) {
    uv.row(cut.faces(c / 3, c % 3)) = map.uv.row(c);
  }
  try {
    const Points2f stored = distortion::round_to_storage(cut.faces, uv, {}, context, stats);
    for (Index c = 0; c < static_cast<Index>(uv32.rows()); ++c)
      uv32.row(c) = stored.row(cut.faces(c / 3, c % 3));
    return true;
  } catch (const NotConverged&) {
    return false;
  }
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

// Cut edges of the input as vertex pairs of the refined mesh.
IndexPairs refined_cuts(const mesh::Surface& surface, const mesh::EdgeFlags& cuts,
                        const intrinsic::InputEdges& edges, const std::vector<std::int64_t>& begin,
                        const intrinsic::RefinedLayout& refined) {
  std::vector<std::array<Index, 2>> pairs;
  for (std::size_t e = 0; e < edges.halfedge.size(); ++e) {
    const HalfedgeId h = edges.halfedge[e];
    if (!cuts[at(h)]) continue;
    Index last = mesh::source(surface.faces, h);
    for (std::int64_t p = begin[e]; p < begin[e + 1]; ++p) {
      const Index v = refined.edge_vertex[static_cast<std::size_t>(p)];
      if (v == kInvalid) continue;
      pairs.push_back({last, v});
      last = v;
    }
    pairs.push_back({last, mesh::target(surface.faces, h)});
  }
  IndexPairs out(static_cast<Eigen::Index>(pairs.size()), 2);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    out.row(static_cast<Eigen::Index>(i)) << pairs[i][0], pairs[i][1];
  }
  return out;
}

// The cuts on the triangulation that the metric was computed on.
mesh::EdgeFlags on_pieces(const mesh::EdgeFlags& cuts, const intrinsic::SplitSurface& split) {
  mesh::EdgeFlags flags(static_cast<std::size_t>(3 * split.faces.rows()), false);
  for (std::size_t h = 0; h < cuts.size(); ++h) {
    for (Index i = split.piece_begin[h]; cuts[h] && i < split.piece_begin[h + 1]; ++i)
      flags[at(split.piece[at(i)])] = true;
  }
  return flags;
}

// The triangulation that the metric was computed on: the input, or the refined start.
struct Ground {
  const intrinsic::SplitSurface* split = nullptr;  // of the refined start
  mesh::Adjacency own_adjacency;
  intrinsic::InputEdges own_edges;
  const mesh::Adjacency* adjacency = nullptr;
  const intrinsic::InputEdges* edges = nullptr;

  Ground(const intrinsic::SplitSurface* split_surface, const mesh::Adjacency& input_adjacency,
         const intrinsic::InputEdges& input_edges)
      : split(split_surface), adjacency(&input_adjacency), edges(&input_edges) {
    if (split == nullptr) return;
    own_adjacency = mesh::build_adjacency(split->vertex_count, split->faces);
    own_edges = intrinsic::number_edges(own_adjacency);
    adjacency = &own_adjacency;
    edges = &own_edges;
  }
  Ground(const Ground&) = delete;
  Ground& operator=(const Ground&) = delete;
};

// Layout of the triangulation that the metric was computed on, seen from the input's corners and
// edges.
intrinsic::MapLayout develop(const ConformalMetric& metric, const Overlay& overlay,
                             const Ground& ground, const intrinsic::InputEdges& edges,
                             const mesh::EdgeFlags& cuts, Stats& stats,
                             const ExecutionContext& context) {
  const intrinsic::SplitSurface* split = ground.split;
  intrinsic::Layout layout =
      lay_out_metric(metric, overlay, *ground.edges, *ground.adjacency,
                     split != nullptr ? on_pieces(cuts, *split) : cuts, context);
  stats["overlay_crossings"] = static_cast<std::int64_t>(overlay.trace.crossings.size());
  stats["straightened_crossings"] = static_cast<std::int64_t>(overlay.straightened.moved);
  stats["bent_crossings"] = static_cast<std::int64_t>(overlay.straightened.kept);
  stats["largest_straightening"] = overlay.straightened.largest_move;
  return split == nullptr
             ? intrinsic::own_layout(std::move(layout), overlay.trace, overlay.positions)
             : intrinsic::composed_layout(
                   {&layout, &overlay.trace, &overlay.positions, ground.edges, ground.adjacency},
                   *split, edges);
}

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

// Why the map cannot be used, if it cannot.
void judge(const RoundedMap& rounded, intrinsic::Refinement refinement,
           const ConformalMetric& metric, ConformalMapResult& result) {
  certify::Parametrization& map = result.map;
  if (!rounded.too_small.empty()) {
    result.failure = refinement == intrinsic::Refinement::kNever
                         ? needs_refinement(rounded.too_small)
                         : not_storable(metric, rounded.too_small);
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

}  // namespace

namespace {

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
  const intrinsic::InputEdges edges = intrinsic::number_edges(adjacency);
  const Prescribed prescribed =
      prescribed_angles(target_angles, solved.metric.on_boundary, options.flat_tolerance);

  const Ground ground(solved.split.get(), adjacency, edges);

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
  std::optional<Overlay> overlay;
  try {
    parallel_for(context, 2, 1, [&](std::size_t task, std::size_t, std::size_t) {
      if (task == 0) {
        overlay = build_overlay(solved.metric, *ground.edges, options.max_crossings, context);
      } else {
        cuts = mesh::cut_to_disks(surface, adjacency, given, prescribed.cones, avoided, context);
      }
    });
  } catch (const NotConverged& e) {
    result.failure = e.error();
    return result;
  }
  lap("seconds_overlay");
  context.report("layout", 0.3);
  const intrinsic::MapLayout developed =
      develop(solved.metric, *overlay, ground, edges, cuts, map.stats, context);
  lap("seconds_layout");
  context.report("refinement", 0.5);
  RoundedMap rounded = refine_and_round(surface, adjacency, developed, edges, options.refinement,
                                        map.stats, context);
  intrinsic::RefinedLayout& refined = rounded.map;
  lap("seconds_refine");
  context.report("certificate", 0.8);

  map.cut_edges = refined_cuts(surface, cuts, edges, developed.begin, refined);
  map.surface = std::move(refined.surface);
  map.uv = std::move(refined.uv);
  map.uv32 = map.uv.cast<float>();
  map.parent_face = std::move(refined.parent_face);
  map.vertex_parent = std::move(refined.vertex_parent);
  map.vertex_barycentric = std::move(refined.vertex_barycentric);
  const auto& wanted = prescribed.request.cone_angles;
  if (!rounded.too_small.empty() && options.refinement != intrinsic::Refinement::kNever &&
      refined.invalid.empty() && repair_rounding(map, map.uv32, map.stats, context) &&
      stored_angle_error(map, wanted) < kStoredAngleTolerance) {
    rounded.too_small.clear();
  }
  lap("seconds_round");
  certify::CertifyRequest request = prescribed.request;
  request.require_distortion = options.positions_are_metric;
  certify::certify_map(map, surface, request, context);
  map.stats["stored_angle_error"] = stored_angle_error(map, wanted);
  lap("seconds_certify");
  map.stats["added_vertices"] =
      static_cast<std::int64_t>(map.surface.vertices.rows()) - vertex_count;
  map.stats["charts"] = static_cast<std::int64_t>(developed.layout.chart_count);
  map.stats["cones"] = static_cast<std::int64_t>(prescribed.cones.size());
  map.stats["closing_error"] = developed.layout.closing_error;
  map.stats["intrinsic_refinement"] = static_cast<std::int64_t>(solved.metric.added.size());
  map.stats["energy"] = map.certificate.energy;
  judge(rounded, options.refinement, solved.metric, result);
  map.stats["seconds_map"] = whole.seconds();
  context.report("certificate", 1.0);
  return result;
}

}  // namespace

ConformalMapResult map_from_metric(const mesh::Surface& surface,
                                   const std::vector<double>& target_angles, RefinedMetric solved,
                                   const ConformalMapOptions& options, ExecutionContext& context) {
  ConformalMapResult result;
  try {
    result = map_of(surface, target_angles, solved, options, context);
  } catch (const TimeIsOver&) {
    // The limit of the metric is one of the whole map; the metric was found in time.
    if (!(options.metric.max_seconds > 0.0)) throw;
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
    try {
      try_refined_start(surface, lengths, target_angles, options, result, context);
    } catch (const NotConverged&) {
    } catch (const TimeIsOver&) {
      if (!(options.metric.max_seconds > 0.0)) throw;
    }
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
