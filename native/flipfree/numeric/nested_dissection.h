// Fill-reducing elimination order by nested dissection of our own: unlike a library call it can be
// cancelled, and it uses all threads.
//
// A part of the graph is split by a small separator that is eliminated last; its two sides
// recursively (George 1973). Separators are the cheapest cuts along breadth-first distances from
// one end of the part, and along the difference of those from both. Parts of up to 64 vertices are
// ordered by minimum degree.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/base/types.h"

namespace flipfree::numeric {
// Graphs as arrays, for elimination orders.

// Symmetric graph without loops: neighbours of v are neighbour[offset[v] .. offset[v + 1]).
struct Graph {
  std::vector<Index> offset;  // count + 1
  std::vector<Index> neighbour;
  Index count() const { return static_cast<Index>(offset.size()) - 1; }
};

template <typename Visit>
void for_neighbours(const Graph& graph, Index v, Visit visit) {
  const auto at = static_cast<std::size_t>(v);
  for (Index i = graph.offset[at]; i < graph.offset[at + 1]; ++i)
    visit(graph.neighbour[static_cast<std::size_t>(i)]);
}

// Where the vertices of a graph lie in the tree of its nested dissection (dissection_tree.h).

// A node by its path from the root, 0 = left, 1 = right, first step in the highest bit; padded with
// ones, and 63 - depth in the six lowest bits: keys in ascending order are the postorder.
class TreeNode {
 public:
  static constexpr int kDeepest = 57;

  constexpr TreeNode() = default;  // the root
  constexpr TreeNode child(int side) const {
    const int d = depth() + 1;
    const std::uint64_t bit = std::uint64_t{1} << (64 - d);
    return TreeNode((key_ & ~bit) | (side != 0 ? bit : 0), d);
  }
  constexpr int depth() const { return 63 - static_cast<int>(key_ & 63); }
  constexpr std::uint64_t key() const { return key_; }
  // Which child of its ancestor at `depth` it lies below; depth < depth().
  constexpr int side_at(int depth) const { return static_cast<int>(key_ >> (63 - depth)) & 1; }
  // Depth of the lowest common node.
  friend constexpr int common_depth(TreeNode a, TreeNode b) {
    const int equal = std::countl_zero((a.key_ ^ b.key_) & ~std::uint64_t{63});
    return std::min({equal, a.depth(), b.depth()});
  }
  // Is one of them an ancestor of the other (or the same)?
  friend constexpr bool on_one_branch(TreeNode a, TreeNode b) {
    return common_depth(a, b) == std::min(a.depth(), b.depth());
  }
  constexpr TreeNode ancestor(int depth) const { return TreeNode(key_, depth); }
  friend constexpr bool operator==(TreeNode a, TreeNode b) = default;

 private:
  constexpr TreeNode(std::uint64_t path, int depth)
      : key_(((path | (~std::uint64_t{0} >> depth)) & ~std::uint64_t{63}) |
             static_cast<std::uint64_t>(63 - depth)) {}
  std::uint64_t key_ = ~std::uint64_t{0};
};

// Node of every vertex of a graph.
using DissectionTree = std::vector<TreeNode>;

// Elimination order of a graph of at most 64 vertices by minimum degree, on sets of 64 bits.

inline constexpr Index kMinimumDegreeLimit = 64;

// Elimination position -> vertex. tree: null, or receives the node of every vertex. Cost:
// O(n log n). Checks for cancel. The same order for any number of threads.
std::vector<Index> nested_dissection(const Graph& graph, const ExecutionContext& context,
                                     DissectionTree* tree = nullptr);

// The tree behind an order by nested dissection, and its repair after a few edges of the graph
// changed.
//
// A node of the tree is a part of the graph; its own vertices are its separator (or all of it, at a
// leaf), and the order is the postorder of the tree: left side, right side, separator. The order is
// good as long as no edge joins vertices of nodes on different branches. A flip joins two vertices
// that were two steps apart, which rarely lie on different branches; where they do, one of them
// moves up to the lowest common node, and vertices that no longer hold two sides apart sink.
// Everything else stays, so a repair costs a few sweeps over the graph where a new order searches
// every separator again.

// Moves vertices until every edge of `graph` lies on one branch, and returns the order: elimination
// position -> vertex. Vertices of one node keep the order they had in `before`, those of leaves are
// ordered anew; leaves that have grown too large are split. Deterministic. Cost: O(n log n) with
// small constants.
std::vector<Index> repair_dissection(const Graph& graph, const std::vector<Index>& before,
                                     DissectionTree& tree, const ExecutionContext& context);

// Nested dissection of graphs that may have hubs: vertices with very many neighbours, as the
// translations of a seamless map are, beside others with few.

// As nested_dissection().
std::vector<Index> hub_dissection(const Graph& graph, const ExecutionContext& context,
                                  DissectionTree& tree);

}  // namespace flipfree::numeric
