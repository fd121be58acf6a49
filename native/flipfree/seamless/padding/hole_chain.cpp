#include "flipfree/seamless/padding/hole_chain.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/base/error.h"
#include "flipfree/base/plane.h"

namespace flipfree::seamless {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

using Loops = std::vector<std::vector<VertexId>>;

// What curves cost that shall turn little: their length, and the square of the quarter turns by
// which they miss what they should turn by.
struct TurningPrice {
  // As the guide says, beside these loops.
  TurningPrice(const Canvas& canvas, const Loops& loops, const ChainGuide& guide) {
    double sum = 0.0;
    for (const auto& loop : loops) sum += canvas.length(canvas.edges_of(loop));
    quarter = guide.quarter_price * (sum / static_cast<double>(loops.size()));
  }
  double cost(double length, double missed) const {
    const double quarters = missed / kQuarterTurn;
    return length + quarter * quarters * quarters;
  }
  double quarter;
};

// Loops of one round may be so much longer than its shortest one.
constexpr double kNotMuchLonger = 2.0;

// Shortest paths from a root through free vertices.
class FreeTree {
 public:
  FreeTree(const Canvas& canvas, VertexId root)
      : canvas_(canvas),
        found_(free_distances(canvas, {}, root)),
        depth_(found_.distance.size(), 0) {
    for (const VertexId v : found_.order) {
      if (v != root) depth_[at(v)] = depth_[at(parent(v))] + 1;
    }
  }

  bool has(HalfedgeId h) const {
    return found_.arrival[at(canvas_.mesh().target(h))] == h ||
           found_.arrival[at(canvas_.mesh().source(h))] == canvas_.mesh().opposite(h);
  }
  // Of the cycle that h closes.
  double cycle_length(HalfedgeId h) const {
    const VertexId a = canvas_.mesh().source(h);
    const VertexId b = canvas_.mesh().target(h);
    return found_.distance[at(a)] + canvas_.length(h) + found_.distance[at(b)] -
           2.0 * found_.distance[at(meet(a, b))];
  }
  std::vector<VertexId> cycle(HalfedgeId h) const {
    VertexId a = canvas_.mesh().source(h);
    VertexId b = canvas_.mesh().target(h);
    const VertexId top = meet(a, b);
    std::vector<VertexId> back;
    for (; a != top; a = parent(a)) back.push_back(a);
    back.push_back(top);
    std::vector<VertexId> cycle(back.rbegin(), back.rend());
    for (; b != top; b = parent(b)) cycle.push_back(b);
    return cycle;
  }

 private:
  VertexId parent(VertexId v) const { return canvas_.mesh().source(found_.arrival[at(v)]); }
  // Their lowest common ancestor.
  VertexId meet(VertexId a, VertexId b) const {
    while (a != b) {
      VertexId& lower = depth_[at(a)] >= depth_[at(b)] ? a : b;
      lower = parent(lower);
    }
    return a;
  }

  const Canvas& canvas_;
  FreeDistances found_;
  std::vector<Index> depth_;
};

// The edges that neither tree nor cotree has, by rising length of their cycles.
std::vector<HalfedgeId> left_over(const Canvas& canvas, const FreeTree& tree) {
  const mesh::EditableTriangulation& mesh = canvas.mesh();
  DisjointSets regions(mesh.face_slots());
  std::vector<std::pair<double, HalfedgeId>> edges;
  for (HalfedgeId h = 0; h < mesh.halfedge_slots(); ++h) {
    const HalfedgeId o = mesh.opposite(h);
    if (h > o || canvas.is_drawn(h)) continue;
    if (!canvas.is_free(mesh.source(h)) || !canvas.is_free(mesh.target(h))) {
      // Not in the graph of free vertices: a curve and a cone with what is around them are one face
      // of it.
      regions.join(h / 3, o / 3);
    } else if (!tree.has(h)) {
      edges.emplace_back(-tree.cycle_length(h), h);
    }
  }
  canvas.context().check();
  std::sort(edges.begin(), edges.end());
  std::vector<HalfedgeId> left;
  for (const auto& [length, h] : edges) {
    if (!regions.join(h / 3, mesh.opposite(h) / 3)) left.push_back(h);
  }
  std::reverse(left.begin(), left.end());
  return left;
}

// Some of the cycles of one tree, disjoint.
Loops round_of_loops(const Canvas& canvas, std::size_t most, const CycleTurns& wished) {
  const auto edges_left = [&](const FreeTree& tree) {
    std::vector<HalfedgeId> left = left_over(canvas, tree);
    if (left.empty()) throw InternalError("fewer handles than the genus");
    return left;
  };
  // Cycles are shortest through the root: one on the shortest cycle of any tree is a better root.
  HalfedgeId any = 0;  // told by the order of faces, not by the numbers of vertices
  while (!canvas.is_free(canvas.mesh().source(any))) {
    if (++any == canvas.mesh().halfedge_slots())
      throw InternalError("a refined surface without free vertices");
  }
  const FreeTree any_tree(canvas, canvas.mesh().source(any));
  const std::vector<VertexId> found = any_tree.cycle(edges_left(any_tree).front());
  const FreeTree tree(canvas, found[found.size() / 2]);
  const std::vector<HalfedgeId> left = edges_left(tree);
  const double longest = kNotMuchLonger * tree.cycle_length(left.front());
  std::vector<std::pair<Index, std::vector<VertexId>>> cycles;  // with their turns
  for (const HalfedgeId h : left) {
    if (tree.cycle_length(h) > longest) break;
    std::vector<VertexId> cycle = tree.cycle(h);
    const Index turn = wished ? std::abs(wished(cycle)) : 0;
    cycles.emplace_back(turn, std::move(cycle));
  }
  std::stable_sort(cycles.begin(), cycles.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<char> taken(at(canvas.vertex_count()), 0);
  Loops loops;
  for (auto& [turn, cycle] : cycles) {
    if (loops.size() == most) break;
    if (std::any_of(cycle.begin(), cycle.end(), [&](VertexId v) { return taken[at(v)] != 0; }))
      continue;
    for (const VertexId v : cycle) taken[at(v)] = 1;
    loops.push_back(std::move(cycle));
  }
  return loops;
}

// A loop that turns by less than this is straight.
constexpr double kStraight = 0.5 * kQuarterTurn;
constexpr int kStraighteningRounds = 4;
// Of a loop's cost: what the first search for another one may cost, and how much more each next.
constexpr double kFirstSearchShare = 1.0 / 32.0;
constexpr double kMoreShare = 2.0;

// The cheapest cycle that meets this loop in one vertex, where it crosses it from the right to the
// left, and no other curve, and turns by less than an eighth; empty if none is found that costs
// less than `most`.
std::vector<VertexId> crossing_cycle(const TurnMeter& meter, const std::vector<VertexId>& loop,
                                     const TurningPrice& price, double most) {
  const Canvas& canvas = meter.canvas();
  const std::size_t n = loop.size();
  const auto edge = [&](std::size_t i, std::size_t by) {
    return canvas.mesh().find(loop[i], loop[(i + by) % n]);
  };
  double least = most;
  std::vector<VertexId> cycle;
  std::vector<HalfedgeId> last;
  for (std::size_t i = 0; i < n; ++i) last.push_back(edge(i, n - 1));
  const std::vector<double> left = free_distances(canvas, canvas.inside(last)).distance;
  for (std::size_t i = 0; i < n; ++i) {
    SheetSearch search = turning_search(meter, left, kSheets[0]);
    for (const HalfedgeId h : canvas.inside({edge(i, 1)})) search.start(h, h, 0.0);
    const auto arrive = [&](const SheetSearch::Way& way) {
      if (canvas.sector_reached(way.arrival) != last[i]) return;
      const double turned = way.gathered + meter.turn(way.arrival, way.from);
      const double cost = price.cost(way.length, turned);
      if (std::abs(turned) >= kStraight || cost >= least) return;
      least = cost;
      cycle.clear();
      for (const HalfedgeId h : search.path(way)) cycle.push_back(canvas.mesh().source(h));
    };
    search.run(arrive, least);
  }
  return cycle;
}

// Exchanges each loop that turns by an eighth and more, the first ones aside, for the cheapest
// cycle that crosses it, if that one costs less. The loops stay disjoint, and no sum of them
// bounds: no other one crosses what the new one does.
void straighten_loops(Canvas& canvas, const TurnMeter& meter, const TurningPrice& price,
                      std::size_t first, Loops& loops) {
  // What crosses a new loop runs beside the old one: perhaps on the other side of a cone.
  std::vector<char> is_new(loops.size(), 0);
  bool changed = true;
  for (int round = 0; std::exchange(changed, false) && round < kStraighteningRounds; ++round) {
    for (std::size_t i = first; i < loops.size(); ++i) {
      const double turn = meter.turn(loops[i]);
      if (std::exchange(is_new[i], 0) == 0 && std::abs(turn) < kStraight) continue;
      const double now = price.cost(canvas.length(canvas.edges_of(loops[i])), turn);
      // What is found for little needs no search far around.
      std::vector<VertexId> cycle;
      for (double most = kFirstSearchShare * now; cycle.empty() && most < kMoreShare * now;
           most *= kMoreShare)
        cycle = crossing_cycle(meter, loops[i], price, std::min(most, now));
      if (cycle.empty()) continue;
      canvas.erase(canvas.edges_of(loops[i]));
      canvas.draw(canvas.edges_of(cycle), Curve::kLoop);
      loops[i] = std::move(cycle);
      is_new[i] = 1;
      changed = true;
    }
  }
}

// Draws loops through free vertices until there are `genus` of them. `first`: one that is there
// already, or empty. A round finds the shortest loop of its tree and those that are disjoint and
// not much longer. With crossings, those that turn by an eighth and more are then exchanged for
// cycles that turn less, if these cost less.
Loops draw_loops(Canvas& canvas, const std::vector<VertexId>& first, Index genus,
                 const ChainGuide& guide) {
  Loops loops;
  if (!first.empty()) loops.push_back(first);
  const std::size_t drawn = loops.size();
  while (loops.size() < at(genus)) {
    for (std::vector<VertexId>& loop :
         round_of_loops(canvas, at(genus) - loops.size(), guide.turning)) {
      // Drawn one by one, an edge between two of them is split before it could be taken for drawn.
      canvas.draw(canvas.edges_of(loop), Curve::kLoop);
      loops.push_back(std::move(loop));
    }
  }
  if (guide.crossings != nullptr) {
    const TurnMeter meter(canvas, *guide.crossings);
    straighten_loops(canvas, meter, {canvas, loops, guide}, drawn, loops);
  }
  return loops;
}

// Gains of an order below this share are rounding.
constexpr double kLeastGain = 1e-9;

constexpr Index partner_of(Index hole) { return hole ^ 1; }

// The holes that cutting along disjoint loops makes, two per loop: hole 2 l is on the left of loop
// l, hole 2 l + 1 on its right.
class Holes {
 public:
  // `loops`: vertices in order, drawn. Their edges must not be split while this is used.
  Holes(const Canvas& canvas, Loops loops)
      : canvas_(canvas),
        loops_(std::move(loops)),
        where_(at(canvas.vertex_count()), {kInvalid, kInvalid}) {
    for (std::size_t l = 0; l < loops_.size(); ++l) {
      for (std::size_t i = 0; i < loops_[l].size(); ++i)
        where_[at(loops_[l][i])] = {static_cast<Index>(l), static_cast<Index>(i)};
    }
  }

  Index count() const { return 2 * static_cast<Index>(loops_.size()); }
  // Sectors of a vertex of the loop on the hole's side, counter-clockwise: one, and one more per
  // connector that ends there.
  std::vector<HalfedgeId> sectors_at(Index hole, VertexId v) const {
    const Index ahead = hole % 2 == 0 ? 1 : -1;
    const HalfedgeId first = canvas_.mesh().find(v, neighbour(v, ahead));
    const HalfedgeId last = canvas_.mesh().find(v, neighbour(v, -ahead));
    std::vector<HalfedgeId> sectors;
    for (HalfedgeId h = first; h != last; h = canvas_.mesh().rotate_ccw(h)) {
      if (canvas_.is_drawn(h)) sectors.push_back(h);
    }
    return sectors;
  }
  // Those of all vertices of the loop that no connector has reached from either side.
  std::vector<HalfedgeId> open_sectors(Index hole) const {
    std::vector<HalfedgeId> sectors;
    for (const VertexId v : loops_[at(hole / 2)]) {
      if (is_open(v)) sectors.push_back(sectors_at(hole, v).front());
    }
    return sectors;
  }
  // Is this sector, of a vertex of the loop, on the hole's side?
  bool has(Index hole, HalfedgeId sector) const {
    const VertexId v = canvas_.mesh().source(sector);
    if (loop_of(v) != hole / 2) return false;
    const std::vector<HalfedgeId> sectors = sectors_at(hole, v);
    return std::find(sectors.begin(), sectors.end(), sector) != sectors.end();
  }
  // The hole on whose side this sector of a loop's vertex is.
  Index hole_of(HalfedgeId sector) const {
    const Index left = 2 * loop_of(canvas_.mesh().source(sector));
    return has(left, sector) ? left : partner_of(left);
  }
  const Loops& loops() const { return loops_; }
  bool is_open(VertexId v) const { return canvas_.drawn_around(v).size() == 2; }
  Index loop_of(VertexId v) const { return at(v) < where_.size() ? where_[at(v)][0] : kInvalid; }

 private:
  VertexId neighbour(VertexId v, Index step) const {
    const std::vector<VertexId>& loop = loops_[at(where_[at(v)][0])];
    const auto n = static_cast<Index>(loop.size());
    return loop[at((where_[at(v)][1] + step + n) % n)];
  }

  const Canvas& canvas_;
  Loops loops_;
  std::vector<std::array<Index, 2>> where_;  // per vertex when this was made: loop, number in it
};

// From hole to hole; symmetric, infinite where nothing is known.
using Costs = Eigen::MatrixXd;

// Of holes that are neighbours: a path from one to the other meets no third one's surroundings.
// Cost: O(#F log #F).
Costs hole_neighbours(const Canvas& canvas, const Holes& holes) {
  const mesh::EditableTriangulation& mesh = canvas.mesh();
  std::vector<HalfedgeId> first;
  for (Index hole = 0; hole < holes.count(); ++hole) {
    for (const HalfedgeId h : canvas.inside(holes.open_sectors(hole))) first.push_back(h);
  }
  const auto [distance, arrival, order] = free_distances(canvas, first);
  std::vector<Index> nearest_hole(distance.size(), kInvalid);
  for (const VertexId v : order) {
    const VertexId before = mesh.source(arrival[at(v)]);
    nearest_hole[at(v)] = canvas.is_free(before) ? nearest_hole[at(before)]
                                                 : holes.hole_of(canvas.sector_of(arrival[at(v)]));
  }
  Costs shortest = Costs::Constant(holes.count(), holes.count(), kInfinity);
  for (HalfedgeId h = 0; h < mesh.halfedge_slots(); ++h) {
    const VertexId v = mesh.source(h);
    const VertexId w = mesh.target(h);
    const Index a = nearest_hole[at(v)];
    const Index b = nearest_hole[at(w)];
    if (a == kInvalid || b == kInvalid || a >= b) continue;
    const double length = distance[at(v)] + canvas.length(h) + distance[at(w)];
    shortest(a, b) = shortest(b, a) = std::min(shortest(a, b), length);
  }
  return shortest;
}

// Are there partners with an odd number of holes between them, the ends aside?
bool has_odd_couple(const std::vector<Index>& order) {
  std::vector<std::size_t> place(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) place[at(order[i])] = i;
  for (std::size_t i = 1; i + 1 < order.size(); ++i) {
    if (place[at(partner_of(order[i]))] % 2 == i % 2) return true;
  }
  return false;
}

// Connectors that were not tried cost so many times the cheapest way over other holes.
constexpr double kDetour = 1.5;
// Loops with whose holes orders begin, and how many holes are moved at once.
constexpr Index kMostBeginnings = 32;
constexpr std::size_t kLongestPart = 3;

// What is not known costs `detour` times the cheapest way over other holes.
void complete(Costs& cost, double detour, const ExecutionContext& context) {
  Costs over = cost;
  for (Index k = 0; k < cost.rows(); ++k) {
    context.check();
    over = over.cwiseMin(over.col(k).replicate(1, cost.cols()) +
                         over.row(k).replicate(cost.rows(), 1));
  }
  cost = cost.cwiseMin(detour * over);
}

// All holes in an order in which one is near the one before; the first and the last are partners.
// odd_couple: with two partners between which there is an odd number of holes, which takes three
// loops or more. From nearest to nearest (thesis 5.4.1).
std::vector<Index> hole_order(Index first, const Costs& cost, bool odd_couple) {
  const auto count = static_cast<std::size_t>(cost.rows());
  std::vector<Index> order = {first};
  std::vector<char> used(count, 0);
  used[at(first)] = used[at(partner_of(first))] = 1;
  while (order.size() + 1 < count) {
    Index nearest = kInvalid;
    for (Index hole = 0; at(hole) < count; ++hole) {
      if (used[at(hole)] == 0 &&
          (nearest == kInvalid || cost(order.back(), hole) < cost(order.back(), nearest)))
        nearest = hole;
    }
    order.push_back(nearest);
    used[at(nearest)] = 1;
  }
  order.push_back(partner_of(first));
  if (odd_couple && !has_odd_couple(order)) {
    // All partners have places of different parity: two neighbours that are no partners change
    // theirs.
    const std::size_t i = order[1] == partner_of(order[2]) ? 2 : 1;
    std::swap(order[i], order[i + 1]);
  }
  return order;
}

// Changes it while that makes it shorter: parts are turned round (2-opt; Croes 1958), short ones
// moved (Or 1976).
void shorten(std::vector<Index>& order, const Costs& cost, bool odd_couple,
             const ExecutionContext& context) {
  const std::size_t count = order.size();
  const auto step = [&](std::size_t i, std::size_t k) { return cost(order[i], order[k]); };
  bool changed = true;
  const auto change = [&](double before, double after, const auto& make) {
    if (!(after < (1.0 - kLeastGain) * before)) return;
    std::vector<Index> other = order;
    make(other.data());
    if (odd_couple && !has_odd_couple(other)) return;
    order = std::move(other);
    changed = true;
  };
  while (std::exchange(changed, false)) {
    context.check();
    for (std::size_t i = 1; i + 1 < count; ++i) {
      for (std::size_t k = i + 2; k < count; ++k) {
        change(step(i - 1, i) + step(k - 1, k), step(i - 1, k - 1) + step(i, k),
               [&](Index* begin) { std::reverse(begin + i, begin + k); });
        for (std::size_t j = i + 1; j < k; ++j) {
          if (j > i + kLongestPart && j + kLongestPart < k) j = k - kLongestPart;
          change(step(i - 1, i) + step(j - 1, j) + step(k - 1, k),
                 step(i - 1, j) + step(k - 1, i) + step(j - 1, k),
                 [&](Index* begin) { std::rotate(begin + i, begin + j, begin + k); });
        }
      }
    }
  }
}

// The shortest of such orders that begin with one loop or another. Cost: O(count^3).
std::vector<Index> hole_tour(const Costs& cost, bool odd_couple, const ExecutionContext& context) {
  std::vector<Index> best;
  double least = kInfinity;
  const auto count = static_cast<Index>(cost.rows());
  const Index step = 2 * (count / (2 * kMostBeginnings) + 1);
  for (Index first = 0; first < count; first += step) {
    std::vector<Index> order = hole_order(first, cost, odd_couple);
    shorten(order, cost, odd_couple, context);
    double sum = 0.0;
    for (std::size_t i = 1; i < order.size(); ++i) sum += cost(order[i - 1], order[i]);
    if (!best.empty() && sum >= least) continue;
    least = sum;
    best = std::move(order);
  }
  return best;
}

// Which way is straight ahead from a hole: at right angles to its loop, as that would run if it
// turned evenly all along.
class HoleFrames {
 public:
  HoleFrames(const TurnMeter& meter, const Loops& loops)
      : meter_(meter), places_(2 * loops.size()) {
    const Canvas& canvas = meter.canvas();
    for (std::size_t hole = 0; hole < places_.size(); ++hole) {
      std::vector<VertexId> loop = loops[hole / 2];
      if (hole % 2 == 1) std::reverse(loop.begin(), loop.end());
      const std::size_t n = loop.size();
      const std::vector<HalfedgeId> edge = canvas.edges_of(loop);
      // Where each edge heads, from where the first does, and where it begins.
      std::vector<double> heading = {0.0}, start = {0.0};
      for (std::size_t i = 1; i < n; ++i) {
        heading.push_back(heading.back() + meter.turn(edge[i - 1], edge[i]));
        start.push_back(start.back() + canvas.length(edge[i - 1]));
      }
      const double length = start.back() + canvas.length(edge.back());
      const double slope = (heading.back() + meter.turn(edge.back(), edge.front())) / length;
      double mean = 0.0;
      for (std::size_t i = 0; i < n; ++i) {
        const double own = canvas.length(edge[i]);
        mean += (heading[i] - slope * (start[i] + 0.5 * own)) * own / length;
      }
      for (std::size_t i = 0; i < n; ++i) {
        const double offset = heading[i] - (mean + slope * start[i]) - kQuarterTurn;
        places_[hole][loop[i]] = {loop[(i + 1) % n], offset};
      }
    }
  }

  // How far to the left of that a half-edge heads which leaves the hole's loop on the hole's side.
  double deviation(Index hole, HalfedgeId departure) const {
    const Canvas& canvas = meter_.canvas();
    const VertexId v = canvas.mesh().source(departure);
    const Place& place = places_[at(hole)].at(v);
    const HalfedgeId along = canvas.mesh().find(v, place.next);
    return place.offset + meter_.angle_between(along, departure);
  }

 private:
  const TurnMeter& meter_;
  struct Place {
    VertexId next = kInvalid;  // along the loop, the hole on the left
    double offset = 0.0;       // of the edge to it, from straight ahead
  };
  std::vector<std::map<VertexId, Place>> places_;  // per hole, by vertex
};

// Times what the loops leave, in vertices. Connectors that refine further wind around each other.
constexpr Index kMostRefined = 3;

// Searches for what connectors will cost end when so many holes were reached for less.
constexpr std::size_t kMostReached = 10;

// Finds connectors that turn little.
class TurningWays {
 public:
  TurningWays(const Canvas& canvas, const Holes& holes, const ChainGuide& guide)
      : canvas_(canvas),
        holes_(holes),
        meter_(canvas, *guide.crossings),
        price_(canvas, holes.loops(), guide),
        frames_(meter_, holes.loops()),
        most_vertices_(kMostRefined * canvas.vertex_count()) {}

  // From one of the sectors, which are of one hole, to another hole, to a vertex that is allowed;
  // empty if there is none.
  std::vector<HalfedgeId> way(const std::vector<HalfedgeId>& from, Index hole,
                              const std::function<bool(VertexId)>& allowed) const {
    if (canvas_.vertex_count() > most_vertices_) {
      throw_not_converged(ErrorCode::kIterationLimit,
                          "Connectors that turn little wind around each other.");
    }
    std::vector<HalfedgeId> last;
    for (const VertexId v : holes_.loops()[at(hole / 2)]) {
      if (!allowed(v)) continue;
      for (const HalfedgeId sector : holes_.sectors_at(hole, v)) last.push_back(sector);
    }
    const std::vector<double> left = free_distances(canvas_, canvas_.inside(last)).distance;
    double least = kInfinity;
    std::vector<HalfedgeId> path;
    for (const std::int64_t sheets : kSheets) {
      SheetSearch search = turning_search(meter_, left, sheets);
      start(from, search);
      const auto arrive = [&](const SheetSearch::Way& way) {
        const HalfedgeId back = canvas_.mesh().opposite(way.arrival);
        const VertexId v = canvas_.mesh().source(back);
        if (holes_.loop_of(v) != hole / 2 || !allowed(v) ||
            !holes_.has(hole, canvas_.sector_of(back)))
          return;
        const double cost = price_.cost(way.length, way.gathered - frames_.deviation(hole, back));
        if (cost >= least) return;
        least = cost;
        path = search.path(way);
      };
      search.run(arrive, least);
      if (!path.empty()) break;
    }
    return path;
  }

  // What connectors cost, before any is drawn, to the holes that are reached for least.
  Costs costs() const {
    const std::vector<double> nothing(at(canvas_.vertex_count()), 0.0);
    const Index count = holes_.count();
    const std::size_t last = std::min(kMostReached, at(count) - 1) - 1;
    Costs cost = Costs::Constant(count, count, kInfinity);
    for (Index hole = 0; hole < count; ++hole) {
      SheetSearch search = turning_search(meter_, nothing, kSheets[0]);
      start(holes_.open_sectors(hole), search);
      std::vector<double> found(at(count), kInfinity);
      double limit = kInfinity;
      const auto arrive = [&](const SheetSearch::Way& way) {
        const HalfedgeId back = canvas_.mesh().opposite(way.arrival);
        const Index to = holes_.hole_of(canvas_.sector_reached(way.arrival));
        const double now = price_.cost(way.length, way.gathered - frames_.deviation(to, back));
        if (to == hole || now >= found[at(to)]) return;
        found[at(to)] = now;
        std::vector<double> sorted = found;
        std::sort(sorted.begin(), sorted.end());
        limit = sorted[last];
      };
      search.run(arrive, limit);
      for (Index to = 0; to < count; ++to)
        cost(hole, to) = cost(to, hole) = std::min(cost(to, hole), found[at(to)]);
    }
    return cost;
  }

 private:
  void start(const std::vector<HalfedgeId>& from, SheetSearch& search) const {
    for (const HalfedgeId sector : from) {
      const Index here = holes_.hole_of(sector);
      for (const HalfedgeId h : canvas_.inside({sector}))
        search.start(h, here, frames_.deviation(here, h));
    }
  }

  const Canvas& canvas_;
  const Holes& holes_;
  const TurnMeter meter_;
  const TurningPrice price_;
  const HoleFrames frames_;
  const Index most_vertices_;
};

struct Ends {
  VertexId from = kInvalid;
  VertexId to = kInvalid;
};

// Loops, drawn, and the connectors between their holes.
class Chain {
 public:
  // `first`: the loop whose holes the chain begins and ends with, which is drawn already; or empty.
  Chain(Canvas& canvas, const std::vector<VertexId>& first, Index genus, const ChainGuide& guide)
      : canvas_(canvas), holes_(canvas, draw_loops(canvas, first, genus, guide)) {
    if (guide.crossings != nullptr) ways_.emplace(canvas, holes_, guide);
  }

  const Holes& holes() const { return holes_; }
  // `from_first`: the first hole is 0.
  std::vector<Index> order(bool odd_couple, bool from_first) const {
    const bool turning = ways_ && !from_first;
    Costs cost = turning ? ways_->costs() : hole_neighbours(canvas_, holes_);
    complete(cost, turning ? kDetour : 1.0, canvas_.context());
    return turning ? hole_tour(cost, odd_couple, canvas_.context())
                   : hole_order(0, cost, odd_couple);
  }

  // A way that turns little, or the shortest one, from one of the sectors to `hole`, to a vertex
  // that is allowed.
  Ends find(const std::vector<HalfedgeId>& from, Index hole,
            const std::function<bool(VertexId)>& allowed) {
    const auto is_end = [&](HalfedgeId h) {
      const HalfedgeId sector = canvas_.sector_reached(h);
      return sector != kInvalid && allowed(canvas_.mesh().target(h)) && holes_.has(hole, sector);
    };
    found_.clear();
    if (ways_) found_ = ways_->way(from, hole, allowed);
    if (found_.empty()) found_ = free_path(canvas_, canvas_.inside(from), is_end);
    if (found_.empty()) {
      throw_not_converged(ErrorCode::kIterationLimit,
                          "The cut found no connector to hole " + std::to_string(hole) +
                              " of the surface cut along short loops. Refine the mesh.");
    }
    return {canvas_.mesh().source(found_.front()), canvas_.mesh().target(found_.back())};
  }

  Ends draw(const std::vector<HalfedgeId>& from, Index hole,
            const std::function<bool(VertexId)>& allowed) {
    const Ends ends = find(from, hole, allowed);
    canvas_.draw(found_, Curve::kConnector);
    return ends;
  }

 private:
  Canvas& canvas_;
  const Holes holes_;
  std::optional<TurningWays> ways_;
  std::vector<HalfedgeId> found_;  // last
};

// Where the chain comes to a loop and goes on from it, on the hole that it visits first.
struct Visit {
  Index hole = kInvalid;
  VertexId come = kInvalid;
  VertexId go = kInvalid;
};

// From a hole to its partner, where they are neighbours in the chain: the same place on both.
VertexId draw_straight_connector(Chain& chain, Index hole) {
  const Holes& holes = chain.holes();
  const auto is_open = [&](VertexId v) { return holes.is_open(v); };
  const Index partner = partner_of(hole);
  // Near to where the shortest way between any two of their vertices ends.
  const VertexId v = chain.find(holes.open_sectors(hole), partner, is_open).to;
  chain.draw(holes.sectors_at(hole, v), partner, [v](VertexId w) { return w == v; });
  return v;
}

// From the only hole to its partner, to another place.
std::array<VertexId, 2> draw_askew_connector(Chain& chain) {
  const Holes& holes = chain.holes();
  const auto anywhere = [](VertexId) { return true; };
  const VertexId from = chain.find(holes.open_sectors(0), 1, anywhere).from;
  const VertexId to =
      chain.draw(holes.sectors_at(0, from), 1, [from](VertexId v) { return v != from; }).to;
  return {from, to};
}

// Connectors from hole to hole. `twisted`: the last one ends elsewhere than the first one began.
// Returns where these two places are.
std::array<VertexId, 2> string_up(Chain& chain, const std::vector<Index>& order, bool twisted) {
  const Holes& holes = chain.holes();
  std::vector<Visit> visits(order.size() / 2);
  VertexId end = kInvalid;
  for (std::size_t i = 0; i + 1 < order.size(); ++i) {
    const Index here = order[i];
    const Index next = order[i + 1];
    Visit& leaving = visits[at(here / 2)];
    if (next == partner_of(here)) {
      leaving.hole = here;
      leaving.go = draw_straight_connector(chain, here);
      continue;
    }
    Visit& reaching = visits[at(next / 2)];
    const bool back =
        leaving.hole == partner_of(here);  // the partner's places, the other way round
    const std::vector<HalfedgeId> from =
        back ? holes.sectors_at(here, leaving.come) : holes.open_sectors(here);
    // Also the last connector, to the partner of the first hole, ends where the first one began.
    const bool met = reaching.hole == partner_of(next) && !(twisted && next == order.back());
    const Ends ends = chain.draw(
        from, next, [&](VertexId v) { return met ? v == reaching.go : holes.is_open(v); });
    end = ends.to;
    if (!back) {
      leaving.hole = here;
      leaving.go = ends.from;
    }
    if (!met) {
      reaching.hole = next;
      reaching.come = ends.to;
    }
  }
  return {visits[at(order.front() / 2)].go, end};
}

}  // namespace

void draw_hole_chain(Canvas& canvas, Index genus, const ChainGuide& guide) {
  Chain chain(canvas, {}, genus, guide);
  string_up(chain, chain.order(genus > 2, false), false);
}

std::array<VertexId, 2> draw_twisted_chain(Canvas& canvas, const std::vector<VertexId>& first,
                                           Index genus, const ChainGuide& guide) {
  Chain chain(canvas, first, genus, guide);
  return genus == 1 ? draw_askew_connector(chain)
                    : string_up(chain, chain.order(false, true), true);
}

std::array<VertexId, 2> draw_chain_with_t_nodes(Canvas& canvas, Index genus,
                                                const ChainGuide& guide) {
  Chain chain(canvas, {}, genus, guide);
  if (genus == 1) return draw_askew_connector(chain);
  const Holes& holes = chain.holes();
  const auto is_open = [&](VertexId v) { return holes.is_open(v); };
  // Holes 0, 2, 3, 1.
  const Ends first = chain.draw(holes.open_sectors(0), 2, is_open);
  const Ends second = chain.draw(holes.sectors_at(2, first.to), 3, is_open);
  const Ends third =
      chain.draw(holes.open_sectors(3), 1, [&](VertexId v) { return v == first.from; });
  return {second.to, third.from};
}

}  // namespace flipfree::seamless
