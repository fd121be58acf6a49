#include "flipfree/seamless/padding/reroute/odd_loop.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/base/error.h"
#include "flipfree/seamless/padding/paths/disk_boundary.h"
#include "flipfree/seamless/padding/paths/free_path.h"

namespace flipfree::seamless {
namespace {

// Where the loop comes to a branch, or leaves it on the other side: the sector that begins with the
// edge from `vertex` to `along`. Gates 2 i and 2 i + 1 are the two sides of one branch.
struct Gate {
  VertexId vertex = kInvalid;
  VertexId along = kInvalid;
};

HalfedgeId sector(const Canvas& canvas, const Gate& gate) {
  return canvas.mesh().find(gate.vertex, gate.along);
}

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
std::vector<Index> partners(const Canvas& canvas, const std::vector<Gate>& gates) {
  const DiskBoundary boundary = disk_boundary(canvas);
  std::vector<std::pair<Index, Index>> order;
  for (Index g = 0; at(g) < gates.size(); ++g)
    order.emplace_back(boundary.place[at(sector(canvas, gates[at(g)]))], g);
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

std::vector<Index> odd_branches(const Canvas& canvas, const mesh::Adjacency& input_adjacency,
                                const BranchGraph& graph, const LoopTurning& turning) {
  std::vector<Index> odd;
  for (const BranchLoop& loop : homology_loops(graph)) {
    if (turning(strip_on_input(canvas, input_adjacency, graph, loop)) % 2 != 0)
      odd.push_back(loop.front() / 2);
  }
  return odd;
}

std::vector<VertexId> draw_loop_across(Canvas& canvas, const BranchGraph& graph,
                                       const std::vector<Index>& branches,
                                       const ExecutionContext& context) {
  const std::vector<Gate> gates = gates_of(graph, branches);
  const std::vector<Index> partner = partners(canvas, gates);
  std::vector<VertexId> loop;
  Index gate = 0;
  do {
    const Index end = partner[at(gate)];
    const HalfedgeId goal = sector(canvas, gates[at(end)]);
    const std::vector<HalfedgeId> way =
        free_path(canvas, {{sector(canvas, gates[at(gate)])}, {}},
                  {[goal](HalfedgeId s) { return s == goal; }, nullptr}, context);
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

}  // namespace flipfree::seamless
