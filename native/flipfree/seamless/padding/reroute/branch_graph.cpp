#include "flipfree/seamless/padding/reroute/branch_graph.h"

#include <algorithm>
#include <map>
#include <utility>

#include "flipfree/base/error.h"

namespace flipfree::seamless {
namespace {

constexpr std::size_t kEdgesPerBranch = 4;

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

BranchGraph branch_graph(const Canvas& canvas) {
  BranchGraph graph;
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
      BranchGraph::Branch& branch = graph.branches.emplace_back();
      branch.kind = canvas.curve(first);
      branch.vertices.push_back(v);
      for (const HalfedgeId h : walked) branch.vertices.push_back(canvas.mesh().target(h));
      const auto end = static_cast<Index>(2 * (graph.branches.size() - 1));
      end_at[first] = end;
      end_at[canvas.mesh().opposite(walked.back())] = end + 1;
    }
  }
  graph.next_end.assign(2 * graph.branches.size(), kInvalid);
  for (const std::vector<HalfedgeId>& drawn : nodes) {
    for (std::size_t i = 0; i < drawn.size(); ++i)
      graph.next_end[at(end_at.at(drawn[i]))] = end_at.at(drawn[(i + 1) % drawn.size()]);
  }
  return graph;
}

HalfedgeId leaving(const Canvas& canvas, const BranchGraph& graph, Index end) {
  const std::vector<VertexId> vertices = graph.walked_from(end);
  return canvas.mesh().find(vertices[0], vertices[1]);
}

Index end_of(const Canvas& canvas, const BranchGraph& graph, HalfedgeId h) {
  for (Index end = 0; at(end) < graph.next_end.size(); ++end) {
    if (graph.node(end) == canvas.mesh().source(h) && leaving(canvas, graph, end) == h) return end;
  }
  throw InternalError("a half-edge that begins no branch");
}

void divide_branches(Canvas& canvas, BranchGraph& graph) {
  for (BranchGraph::Branch& branch : graph.branches) {
    std::vector<HalfedgeId> chain;
    for (std::size_t i = 0; i + 1 < branch.vertices.size(); ++i)
      chain.push_back(canvas.mesh().find(branch.vertices[i], branch.vertices[i + 1]));
    branch.vertices = canvas.divide(chain, kEdgesPerBranch);
  }
}

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

}  // namespace flipfree::seamless
