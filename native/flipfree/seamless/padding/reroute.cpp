#include "flipfree/seamless/padding/reroute.h"

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <map>
#include <numeric>
#include <set>
#include <string>
#include <utility>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/base/error.h"
#include "flipfree/seamless/request.h"

namespace flipfree::seamless {

namespace {

constexpr std::size_t kEdgesPerBranch = 4;
// Vertices that a cut may have more than the input. Branches that wind around few cones again and
// again double the refinement each time.
constexpr Index kMostAdded = 2'000'000;

// The half-edges of the branch that begins with h.
std::vector<HalfedgeId> walk_branch(const Canvas& canvas, HalfedgeId h) {
  std::vector<HalfedgeId> branch = {h};
  while (true) {
    const std::vector<HalfedgeId> drawn = canvas.drawn_around(canvas.mesh().target(h));
    if (drawn.size() != 2) return branch;
    h = drawn[0] == canvas.mesh().opposite(h) ? drawn[1] : drawn[0];
    branch.push_back(h);
  }
}

}  // namespace

std::vector<VertexId> BranchGraph::walked_from(Index end) const {
  std::vector<VertexId> vertices = branch_of(end).vertices;
  if (end % 2 != 0) std::reverse(vertices.begin(), vertices.end());
  return vertices;
}

BranchGraph::BranchGraph(Canvas& drawn_on) : canvas(drawn_on) {
  std::map<HalfedgeId, Index> end_at;
  std::vector<std::vector<HalfedgeId>> nodes;
  for (VertexId v = 0; v < canvas.vertex_count(); ++v) {
    if (!canvas.on_curve(v)) continue;
    const std::vector<HalfedgeId> drawn = canvas.drawn_around(v);
    if (drawn.size() == 2) continue;
    nodes.push_back(drawn);
    for (const HalfedgeId first : drawn) {
      if (end_at.contains(first)) continue;
      const std::vector<HalfedgeId> walked = walk_branch(canvas, first);
      Branch& branch = branches.emplace_back();
      branch.kind = canvas.curve(first);
      branch.vertices.push_back(v);
      for (const HalfedgeId h : walked) branch.vertices.push_back(canvas.mesh().target(h));
      const auto end = static_cast<Index>(2 * (branches.size() - 1));
      end_at[first] = end;
      end_at[canvas.mesh().opposite(walked.back())] = end + 1;
    }
  }
  next_end.assign(2 * branches.size(), kInvalid);
  for (const std::vector<HalfedgeId>& drawn : nodes) {
    for (std::size_t i = 0; i < drawn.size(); ++i)
      next_end[at(end_at.at(drawn[i]))] = end_at.at(drawn[(i + 1) % drawn.size()]);
  }
}

HalfedgeId BranchGraph::leaving(Index end) const {
  const std::vector<VertexId> vertices = walked_from(end);
  return canvas.mesh().find(vertices[0], vertices[1]);
}

Index BranchGraph::end_of(HalfedgeId h) const {
  for (Index end = 0; at(end) < next_end.size(); ++end) {
    if (node(end) == canvas.mesh().source(h) && leaving(end) == h) return end;
  }
  throw InternalError("a half-edge that begins no branch");
}

void BranchGraph::divide() {
  for (Branch& branch : branches)
    branch.vertices = canvas.divide(canvas.edges_along(branch.vertices), kEdgesPerBranch);
}

namespace {

// One loop for each branch that a tree of shortest ways over the nodes leaves out, beginning with
// it: no other loop has that branch. No node twice. Cost: O(branches^2).
std::vector<BranchLoop> homology_loops(const BranchGraph& graph) {
  // Breadth first; per node the end at which the branch that leads back to the root begins.
  std::map<VertexId, Index> back = {{graph.node(0), kInvalid}};
  std::vector<VertexId> queue = {graph.node(0)};
  std::vector<char> in_tree(graph.branches.size(), 0);
  for (std::size_t i = 0; i < queue.size(); ++i) {
    for (Index end = 0; at(end) < graph.next_end.size(); ++end) {
      if (graph.node(end) != queue[i] || !back.try_emplace(graph.node(end ^ 1), end ^ 1).second)
        continue;
      in_tree[at(end / 2)] = 1;
      queue.push_back(graph.node(end ^ 1));
    }
  }
  const auto to_root = [&](VertexId v) {
    BranchLoop way;
    for (Index end = back.at(v); end != kInvalid; end = back.at(graph.node(end ^ 1)))
      way.push_back(end);
    return way;
  };
  std::vector<BranchLoop> loops;
  for (Index b = 0; at(b) < graph.branches.size(); ++b) {
    if (in_tree[at(b)] != 0) continue;
    BranchLoop home = to_root(graph.node(2 * b + 1));
    BranchLoop out = to_root(graph.node(2 * b));
    while (!home.empty() && !out.empty() && home.back() == out.back()) {
      home.pop_back();
      out.pop_back();
    }
    BranchLoop& loop = loops.emplace_back(BranchLoop{2 * b});
    loop.insert(loop.end(), home.begin(), home.end());
    for (auto end = out.rbegin(); end != out.rend(); ++end) loop.push_back(*end ^ 1);
  }
  return loops;
}

using Vertices = std::vector<VertexId>;

Vertices reversed(Vertices vertices) {
  std::reverse(vertices.begin(), vertices.end());
  return vertices;
}

Vertices vertices_along(const Canvas& canvas, const std::vector<HalfedgeId>& path) {
  Vertices vertices = {canvas.mesh().source(path.front())};
  for (const HalfedgeId h : path) vertices.push_back(canvas.mesh().target(h));
  return vertices;
}

// The shortest path from an inner vertex of a branch, on its left, to a cone of one of the excesses
// that are wanted; empty if there is none.
std::vector<HalfedgeId> nearest_spur(const Canvas& canvas, const Vertices& branch,
                                     const std::function<bool(Index)>& is_wanted) {
  std::vector<HalfedgeId> sectors = canvas.edges_along(branch);
  sectors.erase(sectors.begin());
  return free_path(canvas, canvas.inside(sectors),
                   [&](HalfedgeId h) { return is_wanted(canvas.excess(canvas.mesh().target(h))); });
}

// From the end of the branch back to its start on the other side of the disk on its left, so that
// the cones between are on the left.
PathEnds back_along(const DiskBoundary& boundary, const Vertices& branch) {
  const std::vector<HalfedgeId> along = boundary.canvas.edges_along(branch);
  return {(boundary.place[at(along.back())] + 1) % boundary.size(),
          boundary.place[at(along.front())]};
}

// Draws the branch along such a path, on its left or its right.
void draw_instead(Canvas& canvas, const std::vector<HalfedgeId>& path, bool on_right,
                  Vertices& branch) {
  const std::vector<HalfedgeId> old = canvas.edges_along(branch);
  const Curve kind = canvas.curve(old.front());
  branch = vertices_along(canvas, path);
  if (!on_right) branch = reversed(std::move(branch));
  canvas.erase(old);
  canvas.draw(canvas.edges_along(branch), kind);
}

// The shortest one on either side, drawn in the branch's place; false, and nothing is drawn, if the
// search finds none that does not meet itself.
bool draw_shortest_detour(Canvas& canvas, Index change, Vertices& branch) {
  const DiskBoundary boundary(canvas);
  std::vector<HalfedgeId> found[2];
  for (const bool on_right : {false, true}) {
    found[on_right] = shortest_enclosing_path(
        boundary, back_along(boundary, on_right ? reversed(branch) : branch),
        on_right ? change : -change);
  }
  if (found[0].empty() && found[1].empty()) return false;
  const bool on_right =
      found[0].empty() || (!found[1].empty() && canvas.length(found[1]) < canvas.length(found[0]));
  draw_instead(canvas, found[on_right], on_right, branch);
  return true;
}

// From the branch's start to its end around the cone nearest to it that makes for one of the
// changes, and no other (fenced_path()). Always there. Returns the change. Preconditions: none is
// 0, some cone makes for one; the branch has an inner vertex.
Index draw_detour_around_cone(Canvas& canvas, const std::set<Index>& changes, Vertices& branch) {
  const auto left = nearest_spur(canvas, branch, [&](Index e) { return changes.contains(-e); });
  const auto right =
      nearest_spur(canvas, reversed(branch), [&](Index e) { return changes.contains(e); });
  if (left.empty() && right.empty()) throw InternalError("no way from the cut to a cone");
  const bool on_right =
      left.empty() || (!right.empty() && canvas.length(right) < canvas.length(left));
  const VertexId cone = canvas.mesh().target((on_right ? right : left).back());
  const DiskBoundary boundary(canvas);
  const PathEnds ends = back_along(boundary, on_right ? reversed(branch) : branch);
  draw_instead(canvas, fenced_path(boundary, ends, {cone}), on_right, branch);
  return on_right ? canvas.excess(cone) : -canvas.excess(cone);
}

// Quarter turns to the left of the map that padding will make along the loop, on its left side:
// branches are straight, sectors of nodes are right angles, but for those that are divided.
Index turn_to_come(const BranchGraph& graph, const BranchLoop& loop, const Ending& ending) {
  const auto corners = [&](Index sector) {
    const auto& divided = ending.divided;
    return std::find(divided.begin(), divided.end(), sector) == divided.end() ? 1 : 2;
  };
  Index turn = 0;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    if (loop[i] == ending.bent) --turn;
    if ((loop[i] ^ 1) == ending.bent) ++turn;
    const Index arrival = loop[i] ^ 1;
    turn += 2;
    for (Index end = loop[(i + 1) % loop.size()]; end != arrival; end = graph.next_end[at(end)])
      turn -= corners(end);
  }
  return turn;
}

}  // namespace

intrinsic::DualLoop strip_on_input(const Canvas& canvas, const std::vector<VertexId>& cycle) {
  const std::vector<HalfedgeId>& opposite = canvas.input().adjacency().opposite;
  intrinsic::DualLoop strip;
  const auto cross = [&](HalfedgeId h) {
    const HalfedgeId side = canvas.input_side(h);
    if (side != kInvalid) intrinsic::go_across(strip, side, opposite);
  };
  const std::size_t n = cycle.size();
  for (std::size_t i = 0; i < n; ++i) {
    const VertexId v = cycle[i];
    const HalfedgeId out = canvas.mesh().find(v, cycle[(i + 1) % n]);
    HalfedgeId h = next_corner(canvas.mesh().find(cycle[(i + n - 1) % n], v));
    for (; h != out; h = next_corner(canvas.mesh().opposite(h))) cross(h);
  }
  intrinsic::close_strip(strip, opposite);
  if (strip.empty()) throw InternalError("a loop of the cut that shrinks to a point");
  return strip;
}

namespace {

// By how much each loop is asked to turn now.
std::vector<Index> wished_turns(const BranchGraph& graph, const std::vector<BranchLoop>& loops,
                                const LoopTurning& turning) {
  std::vector<Index> turns;
  for (const BranchLoop& loop : loops) {
    Vertices vertices;
    for (const Index end : loop) {
      const Vertices branch = graph.walked_from(end);
      vertices.insert(vertices.end(), branch.begin(), branch.end() - 1);
    }
    turns.push_back(turning(strip_on_input(graph.canvas, vertices)));
  }
  return turns;
}

// Where the loop comes to a branch, or leaves it on the other side: the sector that begins with the
// edge of these ends. Gates 2 i and 2 i + 1 are the two sides of one branch.
using Gate = EdgeEnds;

std::vector<Gate> gates_of(const BranchGraph& graph, const std::vector<Index>& branches) {
  std::vector<Gate> gates;
  for (const Index b : branches) {
    const std::vector<VertexId>& vertices = graph.branches[at(b)].vertices;
    const std::size_t middle = vertices.size() / 2;
    gates.push_back({vertices[middle], vertices[middle + 1]});
    gates.push_back({vertices[middle], vertices[middle - 1]});
  }
  return gates;
}

// Per gate the one to go on to through the disk, such that these ways can be disjoint and make one
// loop. At first each is joined to its neighbour on the boundary; two ways that border on the same
// part of the disk but belong to different loops exchange ends, which makes one loop of both.
std::vector<Index> partners(Canvas& canvas, const std::vector<Gate>& gates) {
  const DiskBoundary boundary(canvas);
  std::vector<std::pair<Index, Index>> order;
  for (Index g = 0; at(g) < gates.size(); ++g)
    order.emplace_back(boundary.place[at(canvas.edge(gates[at(g)]))], g);
  std::sort(order.begin(), order.end());
  DisjointSets loops(static_cast<Index>(gates.size()));
  for (Index g = 0; at(g) < gates.size(); g += 2) loops.join(g, g + 1);
  std::vector<Index> partner(gates.size(), kInvalid);
  const auto join = [&](Index a, Index b) {
    partner[at(a)] = b;
    partner[at(b)] = a;
    loops.join(a, b);
  };
  for (std::size_t i = 0; i < order.size(); i += 2) join(order[i].second, order[i + 1].second);
  const Index first = order.front().second;
  Index last = order[1].second;
  for (std::size_t i = 2; i < order.size(); i += 2) {
    const Index next = order[i].second;
    const Index after = order[i + 1].second;
    if (loops.find(first) == loops.find(next)) {
      // Both ways border on the middle of the disk, and stay there.
      continue;
    }
    // (first last)(next after) to (first after)(last next): the outer one is in the middle's sight.
    join(last, next);
    join(first, after);
    last = after;
  }
  return partner;
}

}  // namespace

std::vector<Index> odd_branches(const BranchGraph& graph, const LoopTurning& turning) {
  const std::vector<BranchLoop> loops = homology_loops(graph);
  const std::vector<Index> turns = wished_turns(graph, loops, turning);
  std::vector<Index> odd;
  for (std::size_t i = 0; i < loops.size(); ++i) {
    if (turns[i] % 2 != 0) odd.push_back(loops[i].front() / 2);
  }
  return odd;
}

std::vector<VertexId> draw_loop_across(const BranchGraph& graph,
                                       const std::vector<Index>& branches) {
  Canvas& canvas = graph.canvas;
  const std::vector<Gate> gates = gates_of(graph, branches);
  const std::vector<Index> partner = partners(canvas, gates);
  std::vector<VertexId> loop;
  Index gate = 0;
  do {
    const Index end = partner[at(gate)];
    const HalfedgeId goal = canvas.edge(gates[at(end)]);
    const std::vector<HalfedgeId> way =
        free_path(canvas, canvas.inside({canvas.edge(gates[at(gate)])}),
                  [&](HalfedgeId h) { return canvas.sector_reached(h) == goal; });
    if (way.empty()) throw InternalError("no way through the disk from branch to branch");
    for (const HalfedgeId h : way) loop.push_back(canvas.mesh().source(h));
    canvas.draw(way, Curve::kFence);
    gate = end ^ 1;
  } while (gate != 0);
  canvas.remove_fences();
  canvas.erase_all();
  canvas.draw(canvas.edges_of(loop), Curve::kLoop);
  return loop;
}

namespace {

// By how much more it must be asked to turn, so that it is by what it will.
std::vector<Index> changes(const BranchGraph& graph, const std::vector<BranchLoop>& loops,
                           const std::vector<Index>& wished, const Ending& ending) {
  std::vector<Index> changes;
  for (std::size_t i = 0; i < loops.size(); ++i)
    changes.push_back(turn_to_come(graph, loops[i], ending) - wished[i]);
  return changes;
}

// All of them, or -1 if one cannot be reached.
Index quarters_off(const std::vector<Index>& changes, Index least) {
  Index sum = 0;
  for (const Index change : changes) {
    if (change != 0 && (least == 0 || change % least != 0)) return -1;
    sum += std::abs(change);
  }
  return sum;
}

// Of the shortest sums of such changes, the same cone as often as it takes, that make `wanted`: all
// that one may begin with. So taking one after the other ends. Breadth first over the sums.
// Precondition: the greatest common divisor of all k - 4 divides `wanted`, which is not 0. Cost:
// O((wanted + largest excess)
// * number of different ones).
std::set<Index> next_changes(const std::vector<Index>& cones, Index wanted) {
  std::set<Index> changes;
  for (const Index k : cones) {
    if (k != kFlat) changes.insert({k - kFlat, kFlat - k});
  }
  if (changes.empty()) throw InternalError("no cone to go around");
  // In a good order no sum is farther from 0 and `wanted` than the largest change.
  const Index most = std::abs(wanted) + *changes.rbegin();
  const auto slot = [most](Index sum) { return static_cast<std::size_t>(sum + most); };
  std::vector<Index> terms(2 * at(most) + 1, kInvalid);  // per sum, fewest
  terms[slot(0)] = 0;
  std::vector<Index> sums = {0};
  for (std::size_t i = 0; i < sums.size() && terms[slot(wanted)] == kInvalid; ++i) {
    for (const Index change : changes) {
      const Index sum = sums[i] + change;
      if (std::abs(sum) > most || terms[slot(sum)] != kInvalid) continue;
      terms[slot(sum)] = terms[slot(sums[i])] + 1;
      sums.push_back(sum);
    }
  }
  if (terms[slot(wanted)] == kInvalid) throw InternalError("no sum of changes is the wanted one");
  std::set<Index> next;
  for (const Index change : changes) {
    const Index rest = wanted - change;
    if (std::abs(rest) <= most && terms[slot(rest)] == terms[slot(wanted)] - 1) next.insert(change);
  }
  return next;
}

// Changes what one branch is asked for; false if the shortest detour was not enough.
bool reroute_branch(Canvas& canvas, Index change, Vertices& branch) {
  for (bool first = true;; first = false) {
    canvas.context().check();
    if (canvas.vertex_count() - static_cast<Index>(canvas.cones().size()) > kMostAdded) {
      throw_not_converged(
          ErrorCode::kIterationLimit,
          "The branches of the cut wind around the cones so often that it has more than " +
              std::to_string(kMostAdded) +
              " vertices more than the surface. Take a field that turns less along the handles, or "
              "with more cones.");
    }
    if (draw_shortest_detour(canvas, change, branch)) return first;
    change -= draw_detour_around_cone(canvas, next_changes(canvas.cones(), change), branch);
    if (change == 0) return false;
  }
}

}  // namespace

std::size_t reroute(BranchGraph& graph, const std::vector<Ending>& endings,
                    const WishedTurns& wished) {
  const std::vector<BranchLoop> loops = homology_loops(graph);
  const std::vector<Index> turns = wished_turns(graph, loops, wished.turning);
  // Turns change by multiples of it; 0 if there are no cones.
  Index least = 0;
  for (const Index k : graph.canvas.cones()) least = std::gcd(least, k - kFlat);
  std::size_t best = endings.size();
  Index fewest = 0;
  for (std::size_t i = 0; i < endings.size(); ++i) {
    const Index off = quarters_off(changes(graph, loops, turns, endings[i]), least);
    if (off < 0 || (best < endings.size() && off >= fewest)) continue;
    best = i;
    fewest = off;
  }
  if (best == endings.size()) {
    throw_not_converged(
        ErrorCode::kBadAngles,
        "The cut cannot turn as the map shall: going around the cones changes its turns by "
        "multiples of " +
            std::to_string(least) +
            " quarters only. Take the engine \"penner\", or a field with one cone more of index "
            "+-1/4.");
  }
  const std::vector<Index> change = changes(graph, loops, turns, endings[best]);
  Reroutings& done = *wished.done;
  done.loops += static_cast<Index>(loops.size());
  done.quarters += fewest;
  for (std::size_t i = 0; i < loops.size(); ++i) {
    if (change[i] == 0) continue;
    Vertices& branch = graph.branches[at(loops[i].front() / 2)].vertices;
    ++(reroute_branch(graph.canvas, change[i], branch) ? done.shortest : done.fallback);
  }
  graph.divide();
  const std::vector<Index> now = wished_turns(graph, loops, wished.turning);
  for (const Index off : changes(graph, loops, now, endings[best])) {
    if (off != 0) throw InternalError("a rerouted cut that does not turn as it was wished");
  }
  return best;
}

}  // namespace flipfree::seamless
