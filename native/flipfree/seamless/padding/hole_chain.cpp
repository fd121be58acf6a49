#include "flipfree/seamless/padding/hole_chain.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <queue>
#include <string>
#include <utility>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/base/error.h"
#include "flipfree/seamless/padding/paths.h"
#include "flipfree/seamless/padding/turning_search.h"

namespace flipfree::seamless {

namespace {

using Loops = std::vector<std::vector<VertexId>>;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

constexpr Index partner_of(Index hole) { return hole ^ 1; }

// The holes that cutting along disjoint loops makes, two per loop: hole 2 l is on the left of loop
// l, hole 2 l + 1 on its right.
class Holes {
 public:
  // `loops`: vertices in order, drawn. Their edges must not be split while this is used.
  Holes(const Canvas& canvas, Loops loops);

  Index count() const { return 2 * static_cast<Index>(loops_.size()); }
  // Sectors of a vertex of the loop on the hole's side, counter-clockwise: one, and one more per
  // connector that ends there.
  std::vector<HalfedgeId> sectors_at(Index hole, VertexId v) const;
  // Those of all vertices of the loop that no connector has reached from either side.
  std::vector<HalfedgeId> open_sectors(Index hole) const;
  // Is this sector, of a vertex of the loop, on the hole's side?
  bool has(Index hole, HalfedgeId sector) const;
  // The hole on whose side this sector of a loop's vertex is.
  Index hole_of(HalfedgeId sector) const;
  const Loops& loops() const { return loops_; }
  bool is_open(VertexId v) const { return canvas_.drawn_around(v).size() == 2; }
  Index loop_of(VertexId v) const;

 private:
  VertexId neighbour(VertexId v, Index step) const;

  const Canvas& canvas_;
  Loops loops_;
  std::vector<std::array<Index, 2>> where_;  // per vertex when this was made: loop, number in it
};

Holes::Holes(const Canvas& canvas, Loops loops)
    : canvas_(canvas),
      loops_(std::move(loops)),
      where_(at(canvas.vertex_count()), {kInvalid, kInvalid}) {
  for (std::size_t l = 0; l < loops_.size(); ++l) {
    for (std::size_t i = 0; i < loops_[l].size(); ++i)
      where_[at(loops_[l][i])] = {static_cast<Index>(l), static_cast<Index>(i)};
  }
}

Index Holes::loop_of(VertexId v) const {
  return at(v) < where_.size() ? where_[at(v)][0] : kInvalid;
}

VertexId Holes::neighbour(VertexId v, Index step) const {
  const std::vector<VertexId>& loop = loops_[at(where_[at(v)][0])];
  const auto n = static_cast<Index>(loop.size());
  return loop[at((where_[at(v)][1] + step + n) % n)];
}

std::vector<HalfedgeId> Holes::sectors_at(Index hole, VertexId v) const {
  const Index ahead = hole % 2 == 0 ? 1 : -1;
  const HalfedgeId first = canvas_.mesh().find(v, neighbour(v, ahead));
  const HalfedgeId last = canvas_.mesh().find(v, neighbour(v, -ahead));
  std::vector<HalfedgeId> sectors;
  for (HalfedgeId h = first; h != last; h = canvas_.mesh().rotate_ccw(h)) {
    if (canvas_.is_drawn(h)) sectors.push_back(h);
  }
  return sectors;
}

std::vector<HalfedgeId> Holes::open_sectors(Index hole) const {
  std::vector<HalfedgeId> sectors;
  for (const VertexId v : loops_[at(hole / 2)]) {
    if (is_open(v)) sectors.push_back(sectors_at(hole, v).front());
  }
  return sectors;
}

bool Holes::has(Index hole, HalfedgeId sector) const {
  const VertexId v = canvas_.mesh().source(sector);
  if (loop_of(v) != hole / 2) return false;
  const std::vector<HalfedgeId> sectors = sectors_at(hole, v);
  return std::find(sectors.begin(), sectors.end(), sector) != sectors.end();
}

Index Holes::hole_of(HalfedgeId sector) const {
  const Index left = 2 * loop_of(canvas_.mesh().source(sector));
  return has(left, sector) ? left : partner_of(left);
}

// Per hole, others and how far they are.
using Distances = std::vector<std::vector<std::pair<Index, double>>>;

// The hole to go on to: the nearest one that is not in the chain yet and not kept for its end.
Index nearest(Index from, const Distances& near, const std::vector<char>& used) {
  using Entry = std::pair<double, Index>;
  std::vector<double> distance(near.size(), kInfinity);
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  distance[at(from)] = 0.0;
  queue.push({0.0, from});
  while (!queue.empty()) {
    const auto [so_far, hole] = queue.top();
    queue.pop();
    if (so_far > distance[at(hole)]) continue;
    if (used[at(hole)] == 0) return hole;
    for (const auto& [other, step] : near[at(hole)]) {
      if (so_far + step >= distance[at(other)]) continue;
      distance[at(other)] = so_far + step;
      queue.push({so_far + step, other});
    }
  }
  // Not joined to the others by any pair: any.
  return static_cast<Index>(std::find(used.begin(), used.end(), 0) - used.begin());
}

// Of holes that are neighbours: a path from one to the other meets no third one's surroundings.
// Cost: O(#F log #F).
Distances hole_neighbours(const Canvas& canvas, const Holes& holes,
                          const ExecutionContext& context) {
  const mesh::EditableTriangulation& mesh = canvas.mesh();
  std::vector<HalfedgeId> first;
  for (Index hole = 0; hole < holes.count(); ++hole) {
    for (const HalfedgeId sector : holes.open_sectors(hole))
      canvas.for_each_inside(sector, [&](HalfedgeId h) { first.push_back(h); });
  }
  const auto [distance, arrival, order] = free_distances(canvas, first, kInvalid, context);
  std::vector<Index> nearest_hole(distance.size(), kInvalid);
  for (const VertexId v : order) {
    const VertexId before = mesh.source(arrival[at(v)]);
    nearest_hole[at(v)] = canvas.is_free(before) ? nearest_hole[at(before)]
                                                 : holes.hole_of(canvas.sector_of(arrival[at(v)]));
  }
  std::map<std::pair<Index, Index>, double> shortest;
  for (HalfedgeId h = 0; h < mesh.halfedge_slots(); ++h) {
    const VertexId v = mesh.source(h);
    const VertexId w = mesh.target(h);
    const Index a = nearest_hole[at(v)];
    const Index b = nearest_hole[at(w)];
    if (a == kInvalid || b == kInvalid || a >= b) continue;
    const double length = distance[at(v)] + canvas.length(h) + distance[at(w)];
    const auto [entry, is_new] = shortest.try_emplace({a, b}, length);
    entry->second = std::min(entry->second, length);
  }
  Distances near(at(holes.count()));
  for (const auto& [ends, length] : shortest) {
    near[at(ends.first)].emplace_back(ends.second, length);
    near[at(ends.second)].emplace_back(ends.first, length);
  }
  return near;
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

// All holes in an order in which one is near the one before; the first, 0, and the last are
// partners. odd_couple: with two partners between which there is an odd number of holes, which
// takes three loops or more. Cost: O(count^2 log count).
std::vector<Index> hole_order(const Distances& near, bool odd_couple) {
  std::vector<Index> order = {0};
  std::vector<char> used(near.size(), 0);
  used[0] = used[at(partner_of(0))] = 1;
  while (order.size() + 1 < near.size()) {
    order.push_back(nearest(order.back(), near, used));
    used[at(order.back())] = 1;
  }
  order.push_back(partner_of(0));
  if (odd_couple && !has_odd_couple(order)) {
    // All partners have places of different parity: two neighbours that are no partners change
    // theirs.
    const std::size_t i = order[1] == partner_of(order[2]) ? 2 : 1;
    std::swap(order[i], order[i + 1]);
  }
  return order;
}

// Loops of one round may be so much longer than its shortest one.
constexpr double kNotMuchLonger = 2.0;

// Shortest paths from a root through free vertices.
class FreeTree {
 public:
  FreeTree(const Canvas& canvas, VertexId root, const ExecutionContext& context)
      : canvas_(canvas),
        found_(free_distances(canvas, {}, root, context)),
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
std::vector<HalfedgeId> left_over(const Canvas& canvas, const FreeTree& tree,
                                  const ExecutionContext& context) {
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
  context.check();
  std::sort(edges.begin(), edges.end());
  std::vector<HalfedgeId> left;
  for (const auto& [length, h] : edges) {
    if (!regions.join(h / 3, mesh.opposite(h) / 3)) left.push_back(h);
  }
  std::reverse(left.begin(), left.end());
  return left;
}

VertexId any_free(const Canvas& canvas) {
  for (VertexId v = 0; v < canvas.vertex_count(); ++v) {
    if (canvas.is_free(v) && canvas.mesh().outgoing(v) != kInvalid) return v;
  }
  throw InternalError("a refined surface without free vertices");
}

// Some of the cycles of one tree, disjoint.
Loops round_of_loops(const Canvas& canvas, std::size_t most, const CycleTurns& wished,
                     const ExecutionContext& context) {
  const auto edges_left = [&](const FreeTree& tree) {
    std::vector<HalfedgeId> left = left_over(canvas, tree, context);
    if (left.empty()) throw InternalError("fewer handles than the genus");
    return left;
  };
  // Cycles are shortest through the root: one on the shortest cycle of any tree is a better root.
  const FreeTree any_tree(canvas, any_free(canvas), context);
  const std::vector<VertexId> found = any_tree.cycle(edges_left(any_tree).front());
  const FreeTree tree(canvas, found[found.size() / 2], context);
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

// Draws loops through free vertices until there are `genus` of them. `drawn`: those that are there
// already, disjoint and independent. A round finds the shortest loop of its tree and those that are
// disjoint and not much longer.
Loops draw_short_loops(Canvas& canvas, Index genus, Loops drawn, const CycleTurns& wished,
                       const ExecutionContext& context) {
  Loops loops = std::move(drawn);
  while (loops.size() < at(genus)) {
    for (std::vector<VertexId>& loop :
         round_of_loops(canvas, at(genus) - loops.size(), wished, context)) {
      // Drawn one by one, an edge between two of them is split before it could be taken for drawn.
      canvas.draw(canvas.edges_of(loop), Curve::kLoop);
      loops.push_back(std::move(loop));
    }
  }
  return loops;
}

// Which way is straight ahead from a hole: at right angles to its loop, as that would run if it
// turned evenly all along.
class HoleFrames {
 public:
  HoleFrames(const TurnMeter& meter, const Loops& loops);

  // How far to the left of that a half-edge heads which leaves the hole's loop on the hole's side.
  double deviation(Index hole, HalfedgeId departure) const;

 private:
  const TurnMeter& meter_;
  struct Place {
    VertexId next = kInvalid;  // along the loop, the hole on the left
    double offset = 0.0;       // of the edge to it, from straight ahead
  };
  std::vector<std::map<VertexId, Place>> places_;  // per hole, by vertex
};

HoleFrames::HoleFrames(const TurnMeter& meter, const Loops& loops)
    : meter_(meter), places_(2 * loops.size()) {
  const Canvas& canvas = meter.canvas();
  for (std::size_t hole = 0; hole < places_.size(); ++hole) {
    std::vector<VertexId> loop = loops[hole / 2];
    if (hole % 2 == 1) std::reverse(loop.begin(), loop.end());
    const std::size_t n = loop.size();
    std::vector<HalfedgeId> edge;
    for (std::size_t i = 0; i < n; ++i)
      edge.push_back(canvas.mesh().find(loop[i], loop[(i + 1) % n]));
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
      const double offset = heading[i] - (mean + slope * start[i]) - TurnMeter::kQuarter;
      places_[hole][loop[i]] = {loop[(i + 1) % n], offset};
    }
  }
}

double HoleFrames::deviation(Index hole, HalfedgeId departure) const {
  const Canvas& canvas = meter_.canvas();
  const VertexId v = canvas.mesh().source(departure);
  const Place& place = places_[at(hole)].at(v);
  const HalfedgeId along = canvas.mesh().find(v, place.next);
  return place.offset + meter_.angle_between(along, departure);
}

// Ways that all searches together look at: twice what surfaces take whose cones lie beside their
// handles. Where no cone is near, no way around one makes a curve turn less.
constexpr std::int64_t kMostWays = 20'000'000;
constexpr std::int64_t kWaysPerVertex = 2000;
// Times what the loops leave, in vertices. Connectors that refine further wind around each other.
constexpr Index kMostRefined = 3;

double mean_length(const Canvas& canvas, const Loops& loops) {
  double sum = 0.0;
  for (const std::vector<VertexId>& loop : loops) {
    for (std::size_t i = 0; i < loop.size(); ++i)
      sum += canvas.length(canvas.mesh().find(loop[i], loop[(i + 1) % loop.size()]));
  }
  return sum / static_cast<double>(loops.size());
}

// Finds connectors that turn little.
class TurningWays {
 public:
  TurningWays(const TurningWays&) = delete;  // the price knows where its ways are counted
  TurningWays& operator=(const TurningWays&) = delete;

  TurningWays(const Canvas& canvas, const Holes& holes, const ChainGuide& guide,
              const ExecutionContext& context)
      : canvas_(canvas),
        holes_(holes),
        context_(context),
        meter_(canvas, *guide.crossings),
        ways_left_(std::min(kMostWays, kWaysPerVertex * canvas.vertex_count())),
        price_{guide.quarter_price * mean_length(canvas, holes.loops()), &ways_left_},
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
      for (const HalfedgeId sector : holes_.sectors_at(hole, v))
        canvas_.for_each_inside(sector, [&](HalfedgeId h) { last.push_back(h); });
    }
    const std::vector<double> left = free_distances(canvas_, last, kInvalid, context_).distance;
    double least = kInfinity;
    std::vector<HalfedgeId> path;
    for (const std::int64_t sheets : {TurningSearch::kSheets, 4 * TurningSearch::kSheets}) {
      TurningSearch search(meter_, left, sheets);
      for (const HalfedgeId sector : from) {
        const Index here = holes_.hole_of(sector);
        canvas_.for_each_inside(sector,
                                [&](HalfedgeId h) { search.start(h, frames_.deviation(here, h)); });
      }
      search.run(
          [&](const TurningSearch::Arrival& arrival) {
            const HalfedgeId back = canvas_.mesh().opposite(arrival.halfedge);
            if (holes_.loop_of(canvas_.mesh().source(back)) != hole / 2 ||
                !allowed(canvas_.mesh().source(back)) || !holes_.has(hole, canvas_.sector_of(back)))
              return;
            const double cost =
                price_.cost(arrival.length, arrival.turned - frames_.deviation(hole, back));
            if (cost >= least) return;
            least = cost;
            path = search.path(arrival);
          },
          [&] { return least; }, price_.ways_left, context_);
      if (!path.empty()) break;
    }
    return path;
  }

 private:
  const Canvas& canvas_;
  const Holes& holes_;
  const ExecutionContext& context_;
  const TurnMeter meter_;
  std::int64_t ways_left_;
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
  Chain(Canvas& canvas, const std::vector<VertexId>& first, Index genus, const ChainGuide& guide,
        const ExecutionContext& context)
      : canvas_(canvas),
        context_(context),
        holes_(canvas, draw_short_loops(canvas, genus, first.empty() ? Loops{} : Loops{first},
                                        guide.turning, context)) {
    if (guide.crossings != nullptr) ways_.emplace(canvas, holes_, guide, context);
  }

  const Holes& holes() const { return holes_; }
  std::vector<Index> order(bool odd_couple) const {
    return hole_order(hole_neighbours(canvas_, holes_, context_), odd_couple);
  }

  // A way that turns little, or the shortest one, from one of the sectors to `hole`, to a vertex
  // that is allowed.
  std::vector<HalfedgeId> find(const std::vector<HalfedgeId>& from, Index hole,
                               const std::function<bool(VertexId)>& allowed) const {
    const auto is_end = [&](HalfedgeId sector) {
      return allowed(canvas_.mesh().source(sector)) && holes_.has(hole, sector);
    };
    std::vector<HalfedgeId> path;
    if (ways_) path = ways_->way(from, hole, allowed);
    if (path.empty()) path = free_path(canvas_, {from, {}}, {is_end, nullptr}, context_);
    if (path.empty()) {
      throw_not_converged(ErrorCode::kIterationLimit,
                          "The cut found no connector to hole " + std::to_string(hole) +
                              " of the surface cut along short loops. Refine the mesh.");
    }
    return path;
  }

  Ends ends(const std::vector<HalfedgeId>& path) const {
    return {canvas_.mesh().source(path.front()), canvas_.mesh().target(path.back())};
  }

  Ends draw(const std::vector<HalfedgeId>& from, Index hole,
            const std::function<bool(VertexId)>& allowed) {
    const std::vector<HalfedgeId> path = find(from, hole, allowed);
    const Ends result = ends(path);
    canvas_.draw(path, Curve::kConnector);
    return result;
  }

 private:
  Canvas& canvas_;
  const ExecutionContext& context_;
  const Holes holes_;
  std::optional<TurningWays> ways_;
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
  const VertexId v = chain.ends(chain.find(holes.open_sectors(hole), partner, is_open)).to;
  chain.draw(holes.sectors_at(hole, v), partner, [v](VertexId w) { return w == v; });
  return v;
}

// From the only hole to its partner, to another place.
std::array<VertexId, 2> draw_askew_connector(Chain& chain) {
  const Holes& holes = chain.holes();
  const auto anywhere = [](VertexId) { return true; };
  const VertexId from = chain.ends(chain.find(holes.open_sectors(0), 1, anywhere)).from;
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

void draw_hole_chain(Canvas& canvas, Index genus, const ExecutionContext& context,
                     const ChainGuide& guide) {
  Chain chain(canvas, {}, genus, guide, context);
  string_up(chain, chain.order(genus > 2), false);
}

std::array<VertexId, 2> draw_twisted_chain(Canvas& canvas, const std::vector<VertexId>& first,
                                           Index genus, const ExecutionContext& context,
                                           const ChainGuide& guide) {
  Chain chain(canvas, first, genus, guide, context);
  return genus == 1 ? draw_askew_connector(chain) : string_up(chain, chain.order(false), true);
}

std::array<VertexId, 2> draw_chain_with_t_nodes(Canvas& canvas, Index genus,
                                                const ExecutionContext& context,
                                                const ChainGuide& guide) {
  Chain chain(canvas, {}, genus, guide, context);
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
