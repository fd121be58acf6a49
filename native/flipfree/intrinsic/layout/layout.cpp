#include "flipfree/intrinsic/layout/layout.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "flipfree/base/stats.h"
#include "flipfree/intrinsic/layout/development.h"

namespace flipfree::intrinsic {

namespace {

// Turns every chart so that its longest boundary edge is horizontal, sets
// charts side by side, and scales the whole into the unit square.
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

ChartPlacement place_charts(const Development& development, const mesh::Adjacency& adjacency) {
  ChartPlacement placement;
  const auto corner_count = static_cast<CornerId>(development.corner.size());
  struct Box {
    long double x0 = std::numeric_limits<long double>::infinity(), y0 = x0, x1 = -x0, y1 = -x0;
    void add(long double x, long double y) {
      x0 = std::min(x0, x), x1 = std::max(x1, x);
      y0 = std::min(y0, y), y1 = std::max(y1, y);
    }
  };
  // Of edges that are about as long the first: rounding must not turn the map.
  constexpr long double kAboutAsLong = 1 - 1e-6L;
  std::vector<Place> longest(at(development.chart_count), Place{0, 0});
  std::vector<long double> most(at(development.chart_count), 0);
  const auto over_boundary = [&](const auto& visit) {
    for (CornerId c = 0; c < corner_count; ++c) {
      if (adjacency.opposite[at(c)] != kInvalid) continue;
      const Place &p = development.corner[at(c)], &q = development.corner[at(next_corner(c))];
      visit(at(development.chart_of_face[at(c / 3)]), Place{q.x - p.x, q.y - p.y});
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
  std::vector<Box> boxes(at(development.chart_count));
  for (CornerId c = 0; c < corner_count; ++c) {
    const std::size_t chart = at(development.chart_of_face[at(c / 3)]);
    const Place& d = placement.direction[chart];
    const Place& p = development.corner[at(c)];
    boxes[chart].add(p.x * d.x - p.y * d.y, p.x * d.y + p.y * d.x);
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

EdgePointMap to_edge_points(const InputDevelopment& developed, const ChartPlacement& placement,
                            const InputEdges& edges, const mesh::Adjacency& adjacency) {
  const Development& development = developed.development;
  EdgePointMap map;
  map.edge_halfedge = edges.halfedge;
  map.edge_of = edges.of_corner;
  map.begin = developed.begin;
  const auto corner_count = static_cast<CornerId>(development.corner.size());
  map.corner_angle = development.corner_angle;
  map.corner_uv.resize(corner_count, 2);
  for (CornerId c = 0; c < corner_count; ++c)
    map.corner_uv.row(c) =
        placement.apply(development.corner[at(c)], development.chart_of_face[at(c / 3)]);
  map.points.resize(developed.along.size());
  for (std::size_t e = 0; e < edges.halfedge.size(); ++e) {
    const HalfedgeId other = adjacency.opposite[at(edges.halfedge[e])];
    const Index left = development.chart_of_face[at(edges.halfedge[e] / 3)];
    const Index right = other == kInvalid ? left : development.chart_of_face[at(other / 3)];
    for (std::int64_t i = map.begin[e]; i < map.begin[e + 1]; ++i) {
      const auto p = static_cast<std::size_t>(i);
      EdgePoint& point = map.points[p];
      point.along = developed.along[p];
      point.uv_left = placement.apply(development.crossing[p][0], left);
      point.uv_right = placement.apply(development.crossing[p][other == kInvalid ? 0 : 1], right);
    }
  }
  return map;
}

// Where the map is finest among these faces (those that could not be rounded):
// 32-bit numbers are finest around zero.
Place finest_place(const Development& development, const ChartPlacement& placement,
                   const std::vector<FaceId>& faces) {
  Place best;
  long double least = std::numeric_limits<long double>::infinity();
  for (const FaceId f : faces) {
    const auto at_corner = [&](Index k) { return development.corner[at(3 * f + k)]; };
    const Place a = at_corner(0), b = at_corner(1), c = at_corner(2);
    const long double size =
        std::max(std::hypot(b.x - a.x, b.y - a.y), std::hypot(c.x - a.x, c.y - a.y));
    if (size < least) {
      least = size;
      const Index chart = development.chart_of_face[at(f)];
      const Place& d = placement.direction[at(chart)];
      const Place& t = placement.shift[at(chart)];
      best = {a.x * d.x - a.y * d.y + t.x, a.x * d.y + a.y * d.x + t.y};
    }
  }
  return best;
}

// The refinement with the fewest faces that cannot be stored: first in the unit
// square, then, where that is too coarse, with the origin moved to the finest
// place. If none can be stored in 32 bits, the best one for 64. Cuts become
// edges of the map.
void refine_and_round(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                      const InputDevelopment& developed, const InputEdges& edges,
                      const mesh::EdgeFlags& cuts, Refinement refinement, MetricLayout& best,
                      const ExecutionContext& context) {
  constexpr int kOrigins = 3;
  const Development& development = developed.development;
  ChartPlacement placement = place_charts(development, adjacency);
  ChartPlacement best_placement = placement;
  std::vector<char> cut;
  for (const HalfedgeId h : edges.halfedge) cut.push_back(cuts[at(h)] ? 1 : 0);
  EdgePointMap points;
  for (int attempt = 0; attempt < kOrigins; ++attempt) {
    points = to_edge_points(developed, placement, edges, adjacency);
    RefinedLayout refined =
        refine_map(surface, adjacency, points, refinement, Storage::k64And32, context);
    if (attempt > 0 && refined.invalid.size() >= best.too_small.size()) break;
    best.too_small = refined.invalid;
    best.map = std::move(refined);
    best_placement = placement;
    best.origin_moves = attempt;
    if (best.too_small.empty()) break;
    placement.origin = finest_place(development, placement, best.too_small);
  }
  if (!best.too_small.empty()) {
    points = to_edge_points(developed, best_placement, edges, adjacency);
    best.map = refine_map(surface, adjacency, points, refinement, Storage::k64Only, context);
  }
  best.cut_edges = edges_on(surface.faces, points, cut, best.map);
}

}  // namespace

MetricOverlay overlay_metric(const FlippedMetric& metric, const SplitSurface* split,
                             const mesh::Adjacency& adjacency, std::int64_t max_crossings,
                             const ExecutionContext& context) {
  mesh::Adjacency own =
      split == nullptr ? adjacency : mesh::build_adjacency(split->vertex_count, split->faces);
  InputEdges edges = number_edges(own);
  std::vector<HalfedgeId> curves;
  curves.reserve(edges.halfedge.size());
  for (const HalfedgeId h : edges.halfedge) curves.push_back(metric.input_halfedge[at(h)]);
  return {&metric, split, std::move(own), std::move(edges),
          build_overlay(metric, curves, max_crossings, context)};
}

MetricLayout lay_out_metric(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                            const MetricOverlay& overlaid, const mesh::EdgeFlags& cuts,
                            Refinement refinement, ExecutionContext& context) {
  MetricLayout out;
  Stopwatch watch;
  context.report("layout", 0.0);
  const InputEdges edges = number_edges(adjacency);
  const InputDevelopment developed = develop(overlaid, edges, cuts, context);
  out.chart_count = developed.development.chart_count;
  out.closing_error = developed.development.closing_error;
  out.seconds_layout = watch.seconds();
  watch.restart();
  context.report("refinement", 0.4);
  refine_and_round(surface, adjacency, developed, edges, cuts, refinement, out, context);
  out.seconds_refine = watch.seconds();
  return out;
}

}  // namespace flipfree::intrinsic
