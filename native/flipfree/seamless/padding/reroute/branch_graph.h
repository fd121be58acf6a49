// The curves on a canvas as a graph of branches from node to node, and loops of it that generate
// the surface's homology (thesis 6.5.2).
#pragma once

#include <vector>

#include "flipfree/seamless/padding/paths/canvas.h"

namespace flipfree::seamless {

// Branch b has two ends, 2 b at its first vertex and 2 b + 1 at its last. A branch as it is walked
// along is named by the end at which that begins. A sector of a node is named by the end that
// begins it, counter-clockwise.
struct BranchGraph {
  struct Branch {
    std::vector<VertexId> vertices;  // with both nodes
    Curve kind = Curve::kNone;
  };
  std::vector<Branch> branches;
  std::vector<Index> next_end;  // per end: the next one around its node, counter-clockwise

  const Branch& branch_of(Index end) const { return branches[static_cast<std::size_t>(end / 2)]; }
  VertexId node(Index end) const {
    const std::vector<VertexId>& vertices = branch_of(end).vertices;
    return end % 2 == 0 ? vertices.front() : vertices.back();
  }
  // The vertices of the branch in the order in which they are walked along.
  std::vector<VertexId> walked_from(Index end) const;
};

// Branches by their first vertex and direction. Cost: O(#V + curves).
BranchGraph branch_graph(const Canvas& canvas);

// The half-edge by which a branch leaves its node at this end, and the end at which a branch has
// this one.
HalfedgeId leaving(const Canvas& canvas, const BranchGraph& graph, Index end);
Index end_of(const Canvas& canvas, const BranchGraph& graph, HalfedgeId leaving);

// Splits edges until every branch has four: paths find places inside each, also three on one side.
void divide_branches(Canvas& canvas, BranchGraph& graph);

// Branches one after the other, each named by the end at which the walk along it begins.
using BranchLoop = std::vector<Index>;
// One loop for each branch that a tree of shortest ways over the nodes leaves out, beginning with
// it: no other loop has that branch. No node twice. Cost: O(branches^2).
std::vector<BranchLoop> homology_loops(const BranchGraph& graph);

}  // namespace flipfree::seamless
