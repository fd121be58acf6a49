#include "flipfree/seamless/padding/loops.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <utility>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/base/error.h"

namespace flipfree::seamless {

namespace {

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

}  // namespace

const TurnMeter::Known& TurnMeter::known(HalfedgeId h) const {
  if (canvas_.vertex_count() != vertex_count_) {
    vertex_count_ = canvas_.vertex_count();
    known_.assign(at(canvas_.mesh().halfedge_slots()), {});
  }
  Known& entry = known_[at(h)];
  if (entry.length >= 0.0) return entry;
  const double a = canvas_.length(h), b = canvas_.length(previous_corner(h)),
               c = canvas_.length(next_corner(h));
  // Half of it, which needles do not spoil (Kahan).
  const double s = 0.5 * (a + b + c);
  const double corner = 2.0 * std::atan2(std::sqrt(std::max(0.0, (s - a) * (s - b))),
                                         std::sqrt(std::max(0.0, s * (s - c))));
  const HalfedgeId side = canvas_.input_side(h);
  return entry = {corner, side == kInvalid ? 0.0 : crossings_[at(side)], a};
}

double TurnMeter::turn(HalfedgeId arrival, HalfedgeId departure) const {
  double result = 0.0;
  bool met = false;
  for_each_turn(arrival, [&](HalfedgeId h, double turn) {
    if (h != departure) return;
    result = turn;
    met = true;
  });
  if (!met) throw InternalError("a turn between half-edges that do not meet");
  return result;
}

double TurnMeter::angle_between(HalfedgeId first, HalfedgeId second) const {
  double angle = 0.0;
  for (HalfedgeId h = first; h != second;) {
    angle += known(h).corner;
    h = canvas_.mesh().rotate_ccw(h);
    if (h != second) angle += known(h).crossing;
  }
  return angle;
}

double TurnMeter::turn(const std::vector<VertexId>& cycle) const {
  const std::size_t n = cycle.size();
  double sum = 0.0;
  HalfedgeId arrival = canvas_.mesh().find(cycle[n - 1], cycle[0]);
  for (std::size_t i = 0; i < n; ++i) {
    const HalfedgeId departure = canvas_.mesh().find(cycle[i], cycle[(i + 1) % n]);
    sum += turn(arrival, departure);
    arrival = departure;
  }
  return sum;
}

TurningPrice::TurningPrice(const Canvas& canvas, const Loops& loops, const ChainGuide& guide) {
  double sum = 0.0;
  for (const auto& loop : loops) sum += canvas.length(canvas.edges_of(loop));
  quarter = guide.quarter_price * (sum / static_cast<double>(loops.size()));
}

SheetSearch turning_search(const TurnMeter& meter, const std::vector<double>& left,
                           std::int64_t sheets) {
  constexpr double kSheetsPerQuarter = 2.0;
  constexpr std::size_t kWaysPerSheet = 2;  // looked at, per vertex
  return {meter.canvas(),
          left,
          {[&meter](HalfedgeId arrival, const SheetSearch::Visit& visit) {
             meter.for_each_turn(arrival, visit);
           },
           kSheetsPerQuarter / kQuarterTurn, sheets, kWaysPerSheet * at(sheets)}};
}

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

}  // namespace flipfree::seamless
