#include "flipfree/conformal/cones/cone_rounding.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <unordered_map>
#include <utility>

#include "flipfree/mesh/adjacency.h"

namespace flipfree::conformal {
namespace {

using std::numbers::pi;

// True metrics in a search, and of them in a row without a better one.
constexpr int kRounds = 16;
constexpr int kPatience = 3;
// Exchanges between two true metrics: the linear model is not trusted for more.
constexpr int kMovesPerRound = 12;
// Cones near an extreme that it may exchange a quantum with.
constexpr std::size_t kPartners = 16;
// The linear model aims below the bound, the true metric being a little different.
constexpr double kAim = 0.95;
// An extreme may also exchange with the place of the opposite extreme in rings around it that begin
// at these numbers of edges.
constexpr std::array<int, 7> kRings{1, 2, 4, 8, 16, 32, 64};
constexpr std::size_t kMostNumbers = 32'000'000;  // of responses kept: 256 MB
constexpr double kLeastGain = 1e-3;               // of the cost, relative
constexpr double kMostConeSteps = 1e6;            // of negative curvature at one cone

struct Extremes {
  VertexId low = 0, high = 0;
  double middle = 0.0, range = 0.0;
};
Extremes extremes_of(const std::vector<double>& u) {
  const auto [low, high] = std::minmax_element(u.begin(), u.end());
  return {static_cast<VertexId>(low - u.begin()), static_cast<VertexId>(high - u.begin()),
          0.5 * (*low + *high), *high - *low};
}

// One quantum more at `to`, one less at `from`; kInvalid: none.
struct Exchange {
  VertexId to = kInvalid, from = kInvalid;
};

class Searcher {
 public:
  Searcher(const LinearPlacement& linear, const ConeSearch& search, const mesh::Surface& surface,
           ExecutionContext& context)
      : linear_(linear),
        search_(search),
        context_(context),
        faces_(surface.faces),
        adjacency_(
            mesh::build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces)),
        distance_(at(static_cast<Index>(surface.vertices.rows())), -1) {}

  // Exchanges until the linear model is content or none helps. False if there was none.
  bool improve(std::vector<double>& u, ConeSteps& cones) {
    for (int move = 0; move < kMovesPerRound; ++move) {
      context_.check();
      if (responses_.size() * u.size() > kMostNumbers) responses_.clear();
      const Extremes e = extremes_of(u);
      if (e.range <= kAim * search_.allowed) return move > 0;
      const double present = cost(u, {});
      Exchange best;
      double least = present * (1.0 - kLeastGain);
      for (const Exchange& x : candidates(u, cones, e)) {
        if (!possible(cones, x)) continue;
        const double c = cost(u, x);
        if (c < least) least = c, best = x;
      }
      if (best.to == kInvalid && best.from == kInvalid) return move > 0;
      apply(u, best);
      change(cones, best.to, 1);
      change(cones, best.from, -1);
    }
    return true;
  }

 private:
  const std::vector<double>& response(VertexId v) {
    const auto known = responses_.find(v);
    if (known != responses_.end()) return known->second;
    return responses_.emplace(v, linear_.response(v, context_)).first->second;
  }

  static void change(ConeSteps& cones, VertexId v, int by) {
    if (v == kInvalid) return;
    if ((cones[v] += by) == 0) cones.erase(v);
  }
  static int steps_at(const ConeSteps& cones, VertexId v) {
    const auto it = cones.find(v);
    return it == cones.end() ? 0 : it->second;
  }

  bool possible(const ConeSteps& cones, const Exchange& x) const {
    if (x.to == x.from) return false;
    std::size_t fresh = 0;
    for (const VertexId v : {x.to, x.from}) {
      if (v == kInvalid) continue;
      if (search_.fixed[at(v)]) return false;
      if (!cones.contains(v)) ++fresh;
    }
    if (x.to != kInvalid && steps_at(cones, x.to) >= search_.most_steps) return false;
    return fresh == 0 || cones.size() + fresh <= static_cast<std::size_t>(search_.max_cones);
  }

  // Exchanges of both extremes with each other and with cones near them; alone, if a boundary
  // takes the rest.
  std::vector<Exchange> candidates(const std::vector<double>& u, const ConeSteps& cones,
                                   const Extremes& e) {
    std::vector<Exchange> all{{e.low, e.high}};
    if (!search_.balanced) all.insert(all.end(), {{e.low, kInvalid}, {kInvalid, e.high}});
    for (const VertexId v : near(cones, e.low)) all.push_back({e.low, v});
    for (const VertexId v : near(cones, e.high)) all.push_back({v, e.high});
    for (const VertexId v : best_in_rings(e.low, u, 1.0)) all.push_back({e.low, v});
    for (const VertexId v : best_in_rings(e.high, u, -1.0)) all.push_back({v, e.high});
    return all;
  }

  // In every ring around v the vertex where sign * u is largest.
  std::vector<VertexId> best_in_rings(VertexId v, const std::vector<double>& u, double sign) {
    std::vector<VertexId> best;
    if (search_.fixed[at(v)]) return best;
    std::vector<VertexId> front{v}, visited{v}, next;
    distance_[at(v)] = 0;
    std::size_t ring = 0;
    VertexId top = kInvalid;
    for (int d = 1; d < 2 * kRings.back() && !front.empty(); ++d) {
      next.clear();
      for (const VertexId w : front) {
        visit_neighbours(w, [&](VertexId x) {
          if (distance_[at(x)] >= 0) return;
          distance_[at(x)] = d;
          visited.push_back(x);
          next.push_back(x);
          if (!search_.fixed[at(x)] && (top == kInvalid || sign * u[at(x)] > sign * u[at(top)]))
            top = x;
        });
      }
      std::swap(front, next);
      const bool last = ring + 1 == kRings.size() || front.empty();
      if (last ? front.empty() : d + 1 == kRings[ring + 1]) {
        if (top != kInvalid) best.push_back(top);
        top = kInvalid;
        ++ring;
      }
    }
    if (top != kInvalid) best.push_back(top);
    for (const VertexId w : visited) distance_[at(w)] = -1;
    return best;
  }
  template <typename Visit>
  void visit_neighbours(VertexId v, const Visit& visit) const {
    const HalfedgeId first = adjacency_.vertex_halfedge[at(v)];
    HalfedgeId h = first;
    do {
      visit(mesh::target(faces_, h));
      const HalfedgeId before = previous_corner(h);
      h = adjacency_.opposite[at(before)];
      if (h == kInvalid) visit(mesh::source(faces_, before));
    } while (h != kInvalid && h != first);
  }

  // Cones in order of their influence on v.
  std::vector<VertexId> near(const ConeSteps& cones, VertexId v) {
    if (search_.fixed[at(v)]) return {};
    const std::vector<double>& g = response(v);
    std::vector<VertexId> list;
    for (const auto& [c, steps] : cones) {
      if (c != v) list.push_back(c);
    }
    const std::size_t count = std::min(kPartners, list.size());
    std::partial_sort(
        list.begin(), list.begin() + static_cast<std::ptrdiff_t>(count), list.end(),
        [&](VertexId a, VertexId b) { return g[at(a)] != g[at(b)] ? g[at(a)] > g[at(b)] : a < b; });
    list.resize(count);
    return list;
  }

  template <typename Visit>
  void after(const std::vector<double>& u, const Exchange& x, const Visit& visit) {
    const std::vector<double>* plus = x.to == kInvalid ? nullptr : &response(x.to);
    const std::vector<double>* minus = x.from == kInvalid ? nullptr : &response(x.from);
    for (std::size_t v = 0; v < u.size(); ++v) {
      double value = u[v];
      if (plus != nullptr) value += search_.quantum * (*plus)[v];
      if (minus != nullptr) value -= search_.quantum * (*minus)[v];
      visit(v, value);
    }
  }

  // A high power of the distance from the middle of the range: nearly the largest one, but it also
  // falls when only one of several peaks does.
  double cost(const std::vector<double>& u, const Exchange& x) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    scratch_.resize(u.size());
    after(u, x, [&](std::size_t v, double value) {
      scratch_[v] = value;
      low = std::min(low, value);
      high = std::max(high, value);
    });
    const double middle = 0.5 * (low + high), unit = 2.0 / search_.allowed;
    double sum = 0.0;
    for (const double value : scratch_) {
      const double d = (value - middle) * unit, d2 = d * d, d4 = d2 * d2;
      sum += d4 * d4 * d4;
    }
    return sum;
  }

  void apply(std::vector<double>& u, const Exchange& x) {
    after(u, x, [&](std::size_t v, double value) { scratch_[v] = value; });
    u = scratch_;
  }

  const LinearPlacement& linear_;
  const ConeSearch& search_;
  ExecutionContext& context_;
  std::unordered_map<VertexId, std::vector<double>> responses_;
  std::vector<double> scratch_;
  const Triangles& faces_;
  mesh::Adjacency adjacency_;
  std::vector<int> distance_;  // #V: scratch, -1 outside best_in_rings
};

// Prim's algorithm: the order in which points are reached, and the one that each hangs on.
struct Tree {
  std::vector<std::size_t> order, parent;
};
Tree shortest_tree(const mesh::Surface& surface, const std::vector<VertexId>& points) {
  const std::size_t count = points.size();
  Tree tree{{0}, std::vector<std::size_t>(count, 0)};
  std::vector<double> distance(count, std::numeric_limits<double>::infinity());
  std::vector<char> reached(count, 0);
  reached[0] = 1;
  while (tree.order.size() < count) {
    const std::size_t last = tree.order.back();
    std::size_t nearest = 0;
    for (std::size_t i = 0; i < count; ++i) {
      if (reached[i]) continue;
      const double d =
          (surface.vertices.row(points[i]) - surface.vertices.row(points[last])).squaredNorm();
      if (d < distance[i]) {
        distance[i] = d;
        tree.parent[i] = last;
      }
      if (nearest == 0 || distance[i] < distance[nearest]) nearest = i;
    }
    reached[nearest] = 1;
    tree.order.push_back(nearest);
  }
  return tree;
}

}  // namespace

ConeSteps round_cones(const mesh::Surface& surface, const std::vector<double>& angles,
                      const std::vector<VertexId>& cones, double quantum, int most_steps) {
  ConeSteps out;
  if (cones.empty()) return out;
  const Tree tree = shortest_tree(surface, cones);
  std::vector<double> wanted;
  wanted.reserve(cones.size());
  for (const VertexId v : cones) wanted.push_back((2 * pi - angles[at(v)]) / quantum);
  for (std::size_t k = cones.size(); k-- > 0;) {
    const std::size_t i = tree.order[k];
    // Curvatures of a surface too degenerate to have any are no numbers of steps.
    const double steps =
        std::isfinite(wanted[i])
            ? std::clamp(std::round(wanted[i]), -kMostConeSteps,
                         std::max(-kMostConeSteps, static_cast<double>(most_steps)))
            : 0.0;
    if (k > 0) wanted[tree.parent[i]] += wanted[i] - steps;
    if (steps != 0.0) out[cones[i]] = static_cast<int>(steps);
  }
  return out;
}

FoundCones search_cones(const mesh::Surface& surface, const LinearPlacement& linear,
                        const ConeSearch& search, ConeSteps start,
                        const std::function<TrueScale(const ConeSteps&)>& measure,
                        ExecutionContext& context) {
  Searcher searcher(linear, search, surface, context);
  FoundCones best{start, std::numeric_limits<double>::infinity()};
  int failures = 0;
  for (int round = 0; round < kRounds && failures < kPatience; ++round) {
    context.report("round cones", static_cast<double>(round) / kRounds);
    TrueScale scale = measure(start);
    if (scale.u.empty()) break;
    ++failures;
    if (scale.range < best.range) {
      best = {start, scale.range};
      failures = 0;
    }
    if (scale.range <= search.allowed) break;
    if (!searcher.improve(scale.u, start)) break;
  }
  return best;
}

}  // namespace flipfree::conformal
