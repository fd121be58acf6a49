#include "flipfree/matchmaker/walk/corridor.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <queue>
#include <utility>

#include "flipfree/base/plane.h"
#include "flipfree/matchmaker/target/target_domain.h"

namespace flipfree::matchmaker {
namespace {

// A leg costs its length, as much again for a clearance of this share of the whole way, in inverse
// proportion, and this share of the whole way for itself.
constexpr double kNarrow = 0.05;
constexpr double kLegCost = 0.1;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

Vector2 nearest_on(const Vector2& a, const Vector2& b, const Vector2& p) {
  const Vector2 along = b - a;
  const double square = along.squaredNorm();
  if (!(square > 0)) return a;
  return a + std::clamp(along.dot(p - a) / square, 0.0, 1.0) * along;
}

// Nearest points of two segments that do not cross: first on ab, second on cd.
std::pair<Vector2, Vector2> nearest(const Vector2& a, const Vector2& b, const Vector2& c,
                                    const Vector2& d) {
  const std::array<std::pair<Vector2, Vector2>, 4> pairs = {
      std::pair{a, nearest_on(c, d, a)}, std::pair{b, nearest_on(c, d, b)},
      std::pair{nearest_on(a, b, c), c}, std::pair{nearest_on(a, b, d), d}};
  return *std::min_element(pairs.begin(), pairs.end(), [](const auto& p, const auto& q) {
    return (p.first - p.second).squaredNorm() < (q.first - q.second).squaredNorm();
  });
}

bool crossing(const Vector2& a, const Vector2& b, const Vector2& c, const Vector2& d) {
  return (cross(b - a, c - a) > 0) != (cross(b - a, d - a) > 0) &&
         (cross(d - c, a - c) > 0) != (cross(d - c, b - c) > 0);
}

// The part of a convex polygon where normal.dot(p) <= offset.
Polygon clipped(const Polygon& polygon, const Vector2& normal, double offset) {
  Polygon result;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector2& p = polygon[i];
    const Vector2& q = polygon[(i + 1) % polygon.size()];
    const double hp = normal.dot(p) - offset;
    const double hq = normal.dot(q) - offset;
    if (hp <= 0) result.push_back(p);
    if ((hp < 0 && hq > 0) || (hp > 0 && hq < 0)) result.push_back(p + hp / (hp - hq) * (q - p));
  }
  return result;
}

bool meets(const Polygon& convex, Vector2 a, Vector2 b) {
  for (std::size_t i = 0; i < convex.size(); ++i) {
    const Vector2& p = convex[i];
    const Vector2 along = convex[(i + 1) % convex.size()] - p;
    const double ha = cross(along, a - p);
    const double hb = cross(along, b - p);
    if (ha <= 0 && hb <= 0) return false;
    if (ha < 0) a += ha / (ha - hb) * (b - a);
    if (hb < 0) b += hb / (hb - ha) * (a - b);
  }
  return true;
}

// Edges by the cells of a square grid that their boxes meet.
class EdgeGrid {
 public:
  explicit EdgeGrid(const std::vector<Obstacles::Edge>& edges) : edges_(edges) {
    if (edges.empty()) return;
    low_ = edges[0].a;
    Vector2 high = low_;
    for (const auto& [a, b, cost] : edges) {
      low_ = low_.cwiseMin(a).cwiseMin(b);
      high = high.cwiseMax(a).cwiseMax(b);
    }
    side_ = std::clamp(static_cast<Index>(std::sqrt(static_cast<double>(edges.size()) / 2)),
                       Index{1}, Index{256});
    step_ = std::max((high - low_).maxCoeff() / static_cast<double>(side_), 1e-300);
    cells_.resize(static_cast<std::size_t>(side_ * side_));
    seen_.assign(edges.size(), 0);
    for (std::size_t e = 0; e < edges.size(); ++e) {
      for_each_cell(edges[e].a, edges[e].b,
                    [&](std::vector<Index>& cell) { cell.push_back(static_cast<Index>(e)); });
    }
  }

  double crossings(const Vector2& a, const Vector2& b) {
    if (edges_.empty()) return 0;
    ++round_;
    double cost = 0;
    const auto pieces = std::max(Index{1}, static_cast<Index>((b - a).norm() / step_));
    const Vector2 step = (b - a) / static_cast<double>(pieces);
    for (Index i = 0; i < pieces; ++i) {
      const Vector2 p = a + static_cast<double>(i) * step;
      for_each_cell(p, p + step, [&](const std::vector<Index>& cell) {
        for (const Index e : cell) {
          if (std::exchange(seen_[static_cast<std::size_t>(e)], round_) == round_) continue;
          const auto& edge = edges_[static_cast<std::size_t>(e)];
          if (crossing(a, b, edge.a, edge.b)) cost += edge.cost;
        }
      });
    }
    return cost;
  }

 private:
  template <typename Visit>
  void for_each_cell(const Vector2& a, const Vector2& b, const Visit& visit) {
    const auto cell = [&](double x) {
      return static_cast<Index>(std::clamp(x / step_, 0.0, static_cast<double>(side_ - 1)));
    };
    const Vector2 p = a.cwiseMin(b) - low_;
    const Vector2 q = a.cwiseMax(b) - low_;
    for (Index y = cell(p.y()); y <= cell(q.y()); ++y) {
      for (Index x = cell(p.x()); x <= cell(q.x()); ++x) {
        visit(cells_[static_cast<std::size_t>(y * side_ + x)]);
      }
    }
  }

  const std::vector<Obstacles::Edge>& edges_;
  Vector2 low_ = Vector2::Zero();
  Index side_ = 0;
  double step_ = 1;
  std::vector<std::vector<Index>> cells_;
  std::vector<Index> seen_;  // per edge the last query that met it
  Index round_ = 0;
};

// What a straight leg costs.
class LegCost {
 public:
  LegCost(const Obstacles& obstacles, double whole)
      : obstacles_(obstacles), whole_(whole), grid_(obstacles.edges) {}
  double operator()(const Vector2& a, const Vector2& b) {
    const double room = clearance(a, b, obstacles_);
    if (!(room > 0)) return kInfinity;
    return (b - a).norm() * (1.0 + kNarrow * whole_ / room) + grid_.crossings(a, b);
  }

 private:
  const Obstacles& obstacles_;
  double whole_;
  EdgeGrid grid_;
};

// The Delaunay triangulation of obstacles and the way's ends, as a graph of gaps.
class Gaps {
 public:
  Gaps(const Vector2& from, const Vector2& to, const Obstacles& obstacles)
      : domain_(triangulate(from, to, obstacles)) {
    const auto& mesh = domain_.triangulation;
    const auto outline = static_cast<Index>(domain_.outline.size());
    const Index points = outline + static_cast<Index>(obstacles.points.size());
    from_ = mesh.halfedge_slots();
    to_ = from_ + 1;
    place_.assign(static_cast<std::size_t>(to_ + 1), Vector2::Zero());
    place_[static_cast<std::size_t>(from_)] = from;
    place_[static_cast<std::size_t>(to_)] = to;
    end_vertex_ = points;
    for (HalfedgeId h = 0; h < mesh.halfedge_slots(); ++h) {
      if (!mesh.alive(h / 3)) continue;
      place_[static_cast<std::size_t>(h)] =
          0.5 * (domain_.point[static_cast<std::size_t>(mesh.source(h))] +
                 domain_.point[static_cast<std::size_t>(mesh.target(h))]);
    }
  }

  std::vector<Vector2> shortest(LegCost& leg_cost, const ExecutionContext& context) const {
    std::vector<double> cost(place_.size(), kInfinity);
    std::vector<Index> previous(place_.size(), kInvalid);
    using Entry = std::pair<double, Index>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
    cost[static_cast<std::size_t>(from_)] = 0;
    open.emplace(0.0, from_);
    while (!open.empty()) {
      const double at = open.top().first;
      const Index node = open.top().second;
      open.pop();
      if (at > cost[static_cast<std::size_t>(node)]) continue;
      context.check();
      if (node == to_) break;
      for_each_neighbour(node, [&](Index other) {
        const double now = at + leg_cost(place(node), place(other));
        if (now < cost[static_cast<std::size_t>(other)]) {
          cost[static_cast<std::size_t>(other)] = now;
          previous[static_cast<std::size_t>(other)] = node;
          open.emplace(now, other);
        }
      });
    }
    std::vector<Vector2> way;
    if (previous[static_cast<std::size_t>(to_)] == kInvalid) return way;
    for (Index node = to_; node != kInvalid; node = previous[static_cast<std::size_t>(node)]) {
      way.push_back(place(node));
    }
    std::reverse(way.begin(), way.end());
    return way;
  }

 private:
  static TargetDomain triangulate(const Vector2& from, const Vector2& to,
                                  const Obstacles& obstacles) {
    std::vector<Vector2> inner = obstacles.points;
    inner.push_back(from);
    inner.push_back(to);
    Polygon outline = obstacles.outline;
    if (outline.empty()) {
      Vector2 low = from;
      Vector2 high = from;
      for (const Vector2& p : inner) {
        low = low.cwiseMin(p);
        high = high.cwiseMax(p);
      }
      const double more = (high - low).maxCoeff();
      low -= Vector2(more, more);
      high += Vector2(more, more);
      outline = {low, {high.x(), low.y()}, high, {low.x(), high.y()}};
    }
    return triangulate_embedded(outline, inner, {});
  }

  const Vector2& place(Index node) const { return place_[static_cast<std::size_t>(node)]; }

  template <typename Visit>
  void visit_edge(HalfedgeId h, const Visit& visit) const {
    const auto& mesh = domain_.triangulation;
    if (!mesh.is_boundary(h)) visit(mesh.edge(h));
  }

  template <typename Visit>
  void for_each_neighbour(Index node, const Visit& visit) const {
    const auto& mesh = domain_.triangulation;
    if (node == from_) {
      mesh.for_each_outgoing(end_vertex_, [&](HalfedgeId h) {
        visit_edge(h, visit);
        visit_edge(next_corner(h), visit);
        if (mesh.target(h) == end_vertex_ + 1) visit(to_);
      });
      return;
    }
    const auto in_face = [&](HalfedgeId h) {
      if (h == kInvalid) return;
      visit_edge(next_corner(h), visit);
      visit_edge(previous_corner(h), visit);
      for (const VertexId v : mesh.corners(h / 3)) {
        if (v == end_vertex_ + 1) visit(to_);
      }
    };
    in_face(node);
    in_face(mesh.opposite(node));
  }

  TargetDomain domain_;
  Index from_ = kInvalid;
  Index to_ = kInvalid;
  VertexId end_vertex_ = kInvalid;  // of `from`; that of `to` is the next
  std::vector<Vector2> place_;      // of nodes: edges by their half-edge, and the two ends
};

}  // namespace

double clearance(const Vector2& a, const Vector2& b, const Obstacles& obstacles) {
  double square = kInfinity;
  for (const Vector2& p : obstacles.points) {
    square = std::min(square, (p - nearest_on(a, b, p)).squaredNorm());
  }
  const Polygon& outline = obstacles.outline;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Vector2& c = outline[i];
    const Vector2& d = outline[(i + 1) % outline.size()];
    if (crossing(a, b, c, d)) return 0;
    const auto [p, q] = nearest(a, b, c, d);
    square = std::min(square, (p - q).squaredNorm());
  }
  // Without obstacles: as much as one could want.
  return std::min(std::sqrt(square), (b - a).norm());
}

Polygon corridor_around(const Vector2& a, const Vector2& b, const Obstacles& obstacles,
                        double reach, double keep) {
  const Vector2 along = reach * (b - a);
  const Vector2 across(-along.y(), along.x());
  Polygon corridor = {a - along - across, b + along - across, b + along + across,
                      a - along + across};
  struct Cut {
    double square;
    Vector2 from, to, to_end;
  };
  std::vector<Cut> cuts;
  for (const Vector2& p : obstacles.points) {
    const Vector2 q = nearest_on(a, b, p);
    cuts.push_back({(p - q).squaredNorm(), q, p, p});
  }
  const Polygon& outline = obstacles.outline;
  std::vector<std::pair<Vector2, Vector2>> walls;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Vector2& c = outline[i];
    const Vector2& d = outline[(i + 1) % outline.size()];
    const auto [p, q] = nearest(a, b, c, d);
    cuts.push_back({(p - q).squaredNorm(), p, q, d});
    walls.emplace_back(c, d);
  }
  std::vector<std::size_t> order(cuts.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t i, std::size_t j) { return cuts[i].square < cuts[j].square; });
  const std::size_t points = obstacles.points.size();
  for (const std::size_t i : order) {
    const Cut& cut = cuts[i];
    const bool inside = i < points
                            ? meets(corridor, cut.to, cut.to)
                            : meets(corridor, walls[i - points].first, walls[i - points].second);
    if (!inside) continue;
    const Vector2 normal = (cut.to - cut.from).normalized();
    corridor = clipped(corridor, normal, normal.dot(cut.from) + keep * std::sqrt(cut.square));
  }
  return corridor;
}

std::vector<Vector2> find_way(const Vector2& from, const Vector2& to, const Obstacles& obstacles,
                              const ExecutionContext& context) {
  if (from == to) return {};
  const auto free = [&](const Vector2& p) {
    return std::find(obstacles.points.begin(), obstacles.points.end(), p) ==
               obstacles.points.end() &&
           (obstacles.outline.empty() || locate_in_polygon(obstacles.outline, p) > 0);
  };
  if (!free(from) || !free(to)) return {};
  const double whole = (to - from).norm();
  LegCost leg_cost(obstacles, whole);
  const double straight = leg_cost(from, to);
  if ((obstacles.edges.empty() && straight <= 1.5 * whole) ||
      obstacles.points.size() + obstacles.outline.size() == 0)
    return {to};
  const std::vector<Vector2> gaps = Gaps(from, to, obstacles).shortest(leg_cost, context);
  if (gaps.empty()) return straight < kInfinity ? std::vector<Vector2>{to} : std::vector<Vector2>{};
  // Fewer and longer legs where that is cheaper.
  std::vector<double> cost(gaps.size(), kInfinity);
  std::vector<std::size_t> previous(gaps.size(), 0);
  cost[0] = 0;
  for (std::size_t j = 1; j < gaps.size(); ++j) {
    context.check();
    for (std::size_t i = 0; i < j; ++i) {
      const double now = cost[i] + leg_cost(gaps[i], gaps[j]) + kLegCost * whole;
      if (now < cost[j]) {
        cost[j] = now;
        previous[j] = i;
      }
    }
  }
  std::vector<Vector2> way;
  for (std::size_t j = gaps.size() - 1; j > 0; j = previous[j]) way.push_back(gaps[j]);
  std::reverse(way.begin(), way.end());
  return way;
}

}  // namespace flipfree::matchmaker
