#include "flipfree/conformal/map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

#include "flipfree/base/tolerances.h"
#include "flipfree/certify/certify.h"
#include "flipfree/conformal/layout.h"
#include "flipfree/conformal/map_cut.h"
#include "flipfree/conformal/overlay_coordinates.h"
#include "flipfree/conformal/overlay_positions.h"
#include "flipfree/conformal/overlay_trace.h"
#include "flipfree/distortion/rounding.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/mesh/validate.h"

namespace flipfree {
namespace {

using conformal::ConformalMetric;
using conformal::Scalars;

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

long double widen(double x) { return x; }
template <int Limbs>
long double widen(const BigFloat<Limbs>& x) {
  return mpfr_get_ld(x.raw(), MPFR_RNDN);
}
std::vector<long double> widen(const Scalars& values) {
  return std::visit(
      [](const auto& v) {
        std::vector<long double> out;
        out.reserve(v.size());
        for (const auto& x : v) out.push_back(widen(x));
        return out;
      },
      values);
}

// How the input's edges run over the final triangulation.
OverlayCoordinates replay(const ConformalMetric& metric, const ExecutionContext& context) {
  FlipMesh mesh;
  mesh.next = metric.initial.next;
  mesh.source = metric.initial.origin;
  mesh.vertex_count = static_cast<Index>(metric.initial.vertex_count());
  OverlayCoordinates coordinates(std::move(mesh));
  std::size_t steps = 0;
  for (const conformal::FlipRecord& record : metric.flips) {
    if ((++steps & 0xffff) == 0) context.check();
    for (int i = 0; i < record.plain.count; ++i) {
      coordinates.flip(
          conformal::IntrinsicMesh::halfedge(record.plain.edges[static_cast<std::size_t>(i)]));
    }
  }
  if (coordinates.current().next != metric.mesh.next) {
    throw InternalError("overlay: the recorded flips do not lead to the final triangulation");
  }
  return coordinates;
}

// The input's edges in corner order.
struct InputEdges {
  std::vector<HalfedgeId> halfedge;  // #E: the corner first seen
  std::vector<Index> of_corner;      // 3 #F
};
InputEdges number_edges(const Adjacency& adjacency) {
  InputEdges edges;
  edges.of_corner.assign(adjacency.opposite.size(), kInvalid);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(adjacency.opposite.size()); ++h) {
    const HalfedgeId o = adjacency.opposite[at(h)];
    if (o != kInvalid && o < h) {
      edges.of_corner[at(h)] = edges.of_corner[at(o)];
    } else {
      edges.of_corner[at(h)] = static_cast<Index>(edges.halfedge.size());
      edges.halfedge.push_back(h);
    }
  }
  return edges;
}

struct Overlay {
  OverlayCoordinates coordinates;
  OverlayTrace trace;
  OverlayPositions positions;
};

Overlay build_overlay(const ConformalMetric& metric, const InputEdges& edges,
                      std::int64_t max_crossings, const ExecutionContext& context) {
  Overlay overlay{replay(metric, context), {}, {}};
  std::vector<HalfedgeId> curves;
  curves.reserve(edges.halfedge.size());
  for (const HalfedgeId h : edges.halfedge) curves.push_back(metric.input_halfedge[at(h)]);
  overlay.trace = trace_overlay(overlay.coordinates, std::move(curves), max_crossings, context);
  const std::vector<long double> u = widen(metric.u);
  std::vector<long double> scale;
  scale.reserve(metric.mesh.unknown.size());
  for (const VertexId v : metric.mesh.unknown) scale.push_back(u[at(v)]);
  overlay.positions =
      locate_crossings(overlay.coordinates, overlay.trace, widen(metric.length), scale, context);
  return overlay;
}

Layout lay_out_metric(const ConformalMetric& metric, const Overlay& overlay,
                      const InputEdges& edges, const Adjacency& adjacency, const EdgeFlags& cuts,
                      const ExecutionContext& context) {
  std::vector<Index> curve_of_edge(metric.initial.edge_count(), kInvalid);
  std::vector<char> cut(metric.initial.edge_count(), 0);
  for (std::size_t e = 0; e < edges.halfedge.size(); ++e) {
    const HalfedgeId h = edges.halfedge[e];
    const EdgeId own = conformal::IntrinsicMesh::edge(metric.input_halfedge[at(h)]);
    curve_of_edge[at(own)] = static_cast<Index>(e);
    cut[at(own)] = adjacency.opposite[at(h)] == kInvalid || cuts[at(h)];
  }
  const LayoutInput input{&overlay.coordinates,   &overlay.trace, &overlay.positions,
                          &metric.input_halfedge, &curve_of_edge, &cut};
  return std::visit([&](const auto& lengths) { return lay_out(input, lengths, context); },
                    metric.length);
}

// Turns every chart so that its longest boundary edge is horizontal, sets charts side by side, and
// scales the whole into the unit square.
struct Placement {
  std::vector<Place> direction;  // per chart: unit complex number by which it is turned
  std::vector<Place> shift;      // per chart, added after turning
  long double scale = 1;
  Place origin;  // subtracted last but one, before scaling
  Vector2 apply(const Place& p, Index chart) const {
    const Place& d = direction[at(chart)];
    const Place& s = shift[at(chart)];
    const long double x = p.x * d.x - p.y * d.y + s.x - origin.x;
    const long double y = p.x * d.y + p.y * d.x + s.y - origin.y;
    return {static_cast<double>(x * scale), static_cast<double>(y * scale)};
  }
};

Placement place_charts(const Layout& layout, const Adjacency& adjacency) {
  Placement placement;
  const auto corner_count = static_cast<CornerId>(layout.corner.size());
  struct Box {
    long double x0 = std::numeric_limits<long double>::infinity(), y0 = x0, x1 = -x0, y1 = -x0;
  };
  // Of edges that are about as long the first: rounding must not turn the map.
  constexpr long double kAboutAsLong = 1 - 1e-6L;
  std::vector<Place> longest(at(layout.chart_count), Place{0, 0});
  std::vector<long double> most(at(layout.chart_count), 0);
  const auto over_boundary = [&](const auto& visit) {
    for (CornerId c = 0; c < corner_count; ++c) {
      if (adjacency.opposite[at(c)] != kInvalid) continue;
      const Place &p = layout.corner[at(c)], &q = layout.corner[at(next_corner(c))];
      visit(at(layout.chart_of_face[at(c / 3)]), Place{q.x - p.x, q.y - p.y});
    }
  };
  over_boundary([&](std::size_t chart, const Place& d) {
    most[chart] = std::max(most[chart], std::hypot(d.x, d.y));
  });
  over_boundary([&](std::size_t chart, const Place& d) {
    Place& best = longest[chart];
    if (best.x == 0 && best.y == 0 && std::hypot(d.x, d.y) >= kAboutAsLong * most[chart]) best = d;
  });
  for (Place& d : longest) {
    const long double norm = std::hypot(d.x, d.y);
    d = norm > 0 ? Place{d.x / norm, -d.y / norm} : Place{1, 0};
  }
  placement.direction = std::move(longest);
  std::vector<Box> boxes(at(layout.chart_count));
  for (CornerId c = 0; c < corner_count; ++c) {
    const Index chart = layout.chart_of_face[at(c / 3)];
    const Place& d = placement.direction[at(chart)];
    const Place& p = layout.corner[at(c)];
    const long double x = p.x * d.x - p.y * d.y, y = p.x * d.y + p.y * d.x;
    Box& b = boxes[at(chart)];
    b.x0 = std::min(b.x0, x), b.x1 = std::max(b.x1, x);
    b.y0 = std::min(b.y0, y), b.y1 = std::max(b.y1, y);
  }
  // Shelves: charts by height in rows about as wide as the whole is high.
  long double area = 0, widest = 0;
  for (const Box& b : boxes) {
    area += (b.x1 - b.x0) * (b.y1 - b.y0);
    widest = std::max(widest, b.x1 - b.x0);
  }
  const long double row_width = std::max(widest, std::sqrt(area) * 1.1L);
  std::vector<Index> order(boxes.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<Index>(i);
  std::stable_sort(order.begin(), order.end(), [&](Index a, Index b) {
    return boxes[at(a)].y1 - boxes[at(a)].y0 > boxes[at(b)].y1 - boxes[at(b)].y0;
  });
  placement.shift.resize(boxes.size());
  long double x = 0, y = 0, shelf = 0, width = 0;
  const long double gap = boxes.size() > 1 ? row_width * 0.01L : 0;
  for (const Index i : order) {
    const Box& b = boxes[at(i)];
    if (x > 0 && x + (b.x1 - b.x0) > row_width * 1.0001L) {
      y += shelf + gap;
      x = shelf = 0;
    }
    placement.shift[at(i)] = {x - b.x0, y - b.y0};
    x += b.x1 - b.x0;
    width = std::max(width, x);
    x += gap;
    shelf = std::max(shelf, b.y1 - b.y0);
  }
  placement.scale = 1 / std::max(width, y + shelf);
  return placement;
}

EdgePointMap to_edge_points(const Layout& layout, const Placement& placement,
                            const Overlay& overlay, const InputEdges& edges,
                            const Adjacency& adjacency) {
  EdgePointMap map;
  map.edge_halfedge = edges.halfedge;
  map.edge_of = edges.of_corner;
  map.begin = overlay.trace.begin;
  const auto corner_count = static_cast<CornerId>(layout.corner.size());
  map.corner_angle = layout.corner_angle;
  map.corner_uv.resize(corner_count, 2);
  for (CornerId c = 0; c < corner_count; ++c) {
    map.corner_uv.row(c) = placement.apply(layout.corner[at(c)], layout.chart_of_face[at(c / 3)]);
  }
  map.points.resize(overlay.trace.crossings.size());
  for (std::size_t e = 0; e < edges.halfedge.size(); ++e) {
    const HalfedgeId other = adjacency.opposite[at(edges.halfedge[e])];
    const Index left = layout.chart_of_face[at(edges.halfedge[e] / 3)];
    const Index right = other == kInvalid ? left : layout.chart_of_face[at(other / 3)];
    for (std::int64_t i = map.begin[e]; i < map.begin[e + 1]; ++i) {
      const auto p = static_cast<std::size_t>(i);
      EdgePoint& point = map.points[p];
      point.along = overlay.positions.on_curve[p];
      point.uv_left = placement.apply(layout.crossing[p][0], left);
      point.uv_right = placement.apply(layout.crossing[p][other == kInvalid ? 0 : 1], right);
    }
  }
  return map;
}

// Where the map is finest among the faces that could not be rounded: 32-bit numbers are finest
// around zero.
Place finest_place(const Layout& layout, const Placement& placement,
                   const std::vector<FaceId>& faces) {
  Place best;
  long double least = std::numeric_limits<long double>::infinity();
  for (const FaceId f : faces) {
    const auto at_corner = [&](Index k) { return layout.corner[at(3 * f + k)]; };
    const Place a = at_corner(0), b = at_corner(1), c = at_corner(2);
    const long double size =
        std::max(std::hypot(b.x - a.x, b.y - a.y), std::hypot(c.x - a.x, c.y - a.y));
    if (size < least) {
      least = size;
      const Index chart = layout.chart_of_face[at(f)];
      const Place& d = placement.direction[at(chart)];
      const Place& t = placement.shift[at(chart)];
      best = {a.x * d.x - a.y * d.y + t.x, a.x * d.y + a.y * d.x + t.y};
    }
  }
  return best;
}

struct RoundedMap {
  RefinedMap map;
  std::vector<FaceId>
      too_small;  // input faces that 32 bits cannot hold; the map is then valid in 64 bits at best
};

// The refinement with the fewest faces that cannot be stored: first in the unit square, then, where
// that is too coarse, with the origin moved to the finest place. If none can be stored in 32 bits,
// the best one for 64.
RoundedMap refine_and_round(const Surface& surface, const Adjacency& adjacency,
                            const Layout& layout, const Overlay& overlay, const InputEdges& edges,
                            Refinement refinement, Stats& stats, const ExecutionContext& context) {
  constexpr int kOrigins = 3;
  Placement placement = place_charts(layout, adjacency);
  Placement best_placement = placement;
  RoundedMap best;
  for (int attempt = 0; attempt < kOrigins; ++attempt) {
    const EdgePointMap points = to_edge_points(layout, placement, overlay, edges, adjacency);
    RefinedMap refined =
        refine_map(surface, adjacency, points, refinement, Storage::k64And32, context);
    if (attempt == 0 || refined.invalid.size() < best.too_small.size()) {
      best.too_small = refined.invalid;
      best.map = std::move(refined);
      best_placement = placement;
      stats["origin_moved"] = std::int64_t{attempt};
    } else {
      break;
    }
    if (best.too_small.empty()) return best;
    placement.origin = finest_place(layout, placement, best.too_small);
  }
  const EdgePointMap points = to_edge_points(layout, best_placement, overlay, edges, adjacency);
  best.map = refine_map(surface, adjacency, points, refinement, Storage::k64Only, context);
  return best;
}

// A map that is valid in 64 bits, rounded to other 32-bit points than the nearest where these would
// flip a triangle. False if there are none.
bool repair_rounding(const Parametrization& map, Points2f& uv32, Stats& stats,
                     ExecutionContext& context) {
  const Adjacency adjacency =
      build_adjacency(static_cast<Index>(map.surface.vertices.rows()), map.surface.faces);
  const CutMesh cut = cut_along(map.surface.faces, adjacency, uv_cuts(adjacency, map.uv));
  Points2 uv(static_cast<Eigen::Index>(cut.vertex_origin.size()), 2);
  for (Index c = 0; c < static_cast<Index>(map.uv.rows()); ++c) {
    uv.row(cut.faces(c / 3, c % 3)) = map.uv.row(c);
  }
  try {
    const Points2f stored = round_to_storage(cut.faces, uv, {}, context, stats);
    for (Index c = 0; c < static_cast<Index>(uv32.rows()); ++c)
      uv32.row(c) = stored.row(cut.faces(c / 3, c % 3));
    return true;
  } catch (const NotConverged&) {
    return false;
  }
}

// Largest difference, over the vertices with a prescribed angle, between that angle and the one of
// the stored values.
double stored_angle_error(const Parametrization& map,
                          const std::vector<std::pair<VertexId, double>>& prescribed) {
  std::vector<double> sum(static_cast<std::size_t>(map.surface.vertices.rows()), 0.0);
  for (CornerId c = 0; c < static_cast<CornerId>(map.uv32.rows()); ++c) {
    const Vector2 p = map.uv32.row(c).cast<double>();
    const Vector2 a = map.uv32.row(next_corner(c)).cast<double>().transpose() - p;
    const Vector2 b = map.uv32.row(previous_corner(c)).cast<double>().transpose() - p;
    sum[at(map.surface.faces(c / 3, c % 3))] += std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b));
  }
  double largest = 0.0;
  for (const auto& [v, angle] : prescribed)
    largest = std::max(largest, std::abs(sum[at(v)] - angle));
  return largest;
}

// Cut edges of the input as vertex pairs of the refined mesh.
IndexPairs refined_cuts(const Surface& surface, const EdgeFlags& cuts, const InputEdges& edges,
                        const std::vector<std::int64_t>& begin, const RefinedMap& refined) {
  std::vector<std::array<Index, 2>> pairs;
  for (std::size_t e = 0; e < edges.halfedge.size(); ++e) {
    const HalfedgeId h = edges.halfedge[e];
    if (!cuts[at(h)]) continue;
    Index last = source(surface.faces, h);
    for (std::int64_t p = begin[e]; p < begin[e + 1]; ++p) {
      const Index v = refined.edge_vertex[static_cast<std::size_t>(p)];
      if (v == kInvalid) continue;
      pairs.push_back({last, v});
      last = v;
    }
    pairs.push_back({last, target(surface.faces, h)});
  }
  IndexPairs out(static_cast<Eigen::Index>(pairs.size()), 2);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    out.row(static_cast<Eigen::Index>(i)) << pairs[i][0], pairs[i][1];
  }
  return out;
}

std::string scientific(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", x);
  return text;
}

Error not_storable(const ConformalMetric& metric, const std::vector<FaceId>& faces) {
  Error error;
  error.code = ErrorCode::kRoundingFlips;
  error.kind = ElementKind::kFace;
  const std::size_t count = std::min<std::size_t>(faces.size(), 1000);
  error.elements.assign(faces.begin(), faces.begin() + static_cast<std::ptrdiff_t>(count));
  error.message = "The metric is computed (largest angle error " + scientific(metric.angle_error) +
                  "), but its scale factors span a factor of " +
                  scientific(std::exp(metric.scale_range)) + ", so " +
                  std::to_string(faces.size()) +
                  " input faces are too small in the map for 32-bit UVs, first face " +
                  std::to_string(faces[0]) +
                  ". Spread the curvature over more cones (suggest_cones), add cuts, or use the "
                  "metric as it is.";
  return error;
}

Error needs_refinement(const std::vector<FaceId>& faces) {
  Error error;
  error.code = ErrorCode::kCertificateFailed;
  error.kind = ElementKind::kFace;
  error.elements.assign(
      faces.begin(),
      faces.begin() + static_cast<std::ptrdiff_t>(std::min<std::size_t>(faces.size(), 1000)));
  error.message = "On the original triangles " + std::to_string(faces.size()) +
                  " faces would flip, first face " + std::to_string(faces[0]) +
                  ". Allow points to be added (original_triangles=\"auto\").";
  return error;
}

}  // namespace

ConformalMapResult map_from_metric(const Surface& surface, const std::vector<double>& target_angles,
                                   ConformalMetric metric, const ConformalMapOptions& options,
                                   ExecutionContext& context) {
  const auto vertex_count = static_cast<Index>(surface.vertices.rows());
  const Adjacency adjacency = build_adjacency(vertex_count, surface.faces);
  const EdgeFlags given = flag_edges(surface.faces, adjacency, options.cuts);
  const InputEdges edges = number_edges(adjacency);

  std::vector<VertexId> cones;
  CertifyRequest request;
  for (VertexId v = 0; v < vertex_count; ++v) {
    const bool boundary = metric.on_boundary[at(v)];
    const bool cone =
        !boundary && std::abs(target_angles[at(v)] - 2 * std::numbers::pi) > options.flat_tolerance;
    if (cone) cones.push_back(v);
    if (cone || (boundary && target_angles[at(v)] > 0))
      request.cone_angles.emplace_back(v, target_angles[at(v)]);
  }

  ConformalMapResult result;
  Parametrization& map = result.map;
  Stopwatch watch;
  const auto lap = [&](const char* name) {
    map.stats[name] = watch.seconds();
    watch.restart();
  };
  context.report("overlay", 0.0);
  const EdgeFlags avoided = options.uncuttable.rows() == 0
                                ? EdgeFlags{}
                                : flag_edges(surface.faces, adjacency, options.uncuttable);
  const EdgeFlags cuts = cut_to_disks(surface, adjacency, given, cones, avoided, context);
  lap("seconds_cut");
  std::optional<Overlay> overlay;
  try {
    overlay = build_overlay(metric, edges, options.max_crossings, context);
  } catch (const NotConverged& e) {
    result.failure = e.error();
    result.metric = std::move(metric);
    return result;
  }
  lap("seconds_overlay");
  context.report("layout", 0.3);
  const Layout layout = lay_out_metric(metric, *overlay, edges, adjacency, cuts, context);
  lap("seconds_layout");
  context.report("refinement", 0.5);
  RoundedMap rounded = refine_and_round(surface, adjacency, layout, *overlay, edges,
                                        options.refinement, map.stats, context);
  RefinedMap& refined = rounded.map;
  lap("seconds_refine");
  context.report("certificate", 0.8);

  map.cut_edges = refined_cuts(surface, cuts, edges, overlay->trace.begin, refined);
  map.surface = std::move(refined.surface);
  map.uv = std::move(refined.uv);
  map.uv32 = map.uv.cast<float>();
  map.parent_face = std::move(refined.parent_face);
  map.vertex_parent = std::move(refined.vertex_parent);
  map.vertex_barycentric = std::move(refined.vertex_barycentric);
  if (!rounded.too_small.empty() && options.refinement != Refinement::kNever &&
      refined.invalid.empty() && repair_rounding(map, map.uv32, map.stats, context) &&
      stored_angle_error(map, request.cone_angles) < kStoredAngleTolerance) {
    rounded.too_small.clear();
  }
  lap("seconds_round");
  certify_map(map, surface, request, context);
  map.stats["stored_angle_error"] = stored_angle_error(map, request.cone_angles);
  lap("seconds_certify");
  map.stats["overlay_crossings"] = static_cast<std::int64_t>(overlay->trace.crossings.size());
  map.stats["added_vertices"] =
      static_cast<std::int64_t>(map.surface.vertices.rows()) - vertex_count;
  map.stats["charts"] = static_cast<std::int64_t>(layout.chart_count);
  map.stats["cones"] = static_cast<std::int64_t>(cones.size());
  map.stats["closing_error"] = layout.closing_error;
  map.stats["energy"] = map.certificate.energy;
  if (!rounded.too_small.empty()) {
    result.failure = options.refinement == Refinement::kNever
                         ? needs_refinement(rounded.too_small)
                         : not_storable(metric, rounded.too_small);
  } else if (!map.certificate.ok) {
    result.failure =
        Error{ErrorCode::kCertificateFailed,
              "The map did not pass its certificate: " + map.certificate.failures.front(),
              ElementKind::kFace, map.certificate.failed_faces};
  }
  if (result.failure && map.certificate.ok) {
    // Positive triangles everywhere, but only because rounding bent the cones.
    map.certificate.ok = false;
    map.certificate.failures.push_back(
        "G5: the stored 32-bit values differ from a prescribed angle by " +
        scientific(std::get<double>(map.stats["stored_angle_error"])) + " radians");
  }
  context.report("certificate", 1.0);
  result.metric = std::move(metric);
  return result;
}

ConformalMapResult conformal_map(const Surface& surface, const Points3* lengths,
                                 const std::vector<double>& target_angles,
                                 const ConformalMapOptions& options, ExecutionContext& context) {
  if (options.cuts.rows() > 0) {
    // Complain about cuts before the work, not after.
    validate(surface, {}, context);
    flag_edges(surface.faces,
               build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces),
               options.cuts);
  }
  conformal::ConformalMetric metric;
  {
    const ProgressRange range(context, 0.0, 0.7);
    metric =
        lengths == nullptr
            ? conformal::compute_conformal_metric(surface, target_angles, options.metric, context)
            : conformal::compute_conformal_metric(static_cast<Index>(surface.vertices.rows()),
                                                  surface.faces, *lengths, target_angles,
                                                  options.metric, context);
  }
  const ProgressRange range(context, 0.7, 1.0);
  return map_from_metric(surface, target_angles, std::move(metric), options, context);
}

}  // namespace flipfree
