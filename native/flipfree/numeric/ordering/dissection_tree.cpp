#include "flipfree/numeric/ordering/dissection_tree.h"

#include "flipfree/numeric/ordering/minimum_degree.h"
#include "flipfree/numeric/ordering/nested_dissection.h"

namespace flipfree::numeric {
namespace {

// The lowest node at or below the one of v's ancestors at depth `from` that lies on one branch with
// all neighbours of v and above none of them needlessly: the walk down stops where neighbours lie
// on both sides, or on none.
TreeNode lowest_node(const Graph& graph, const DissectionTree& tree, Index v, TreeNode from) {
  for (;;) {
    if (from.depth() >= TreeNode::kDeepest) return from;
    bool below[2] = {false, false};
    for_neighbours(graph, v, [&](Index u) {
      const TreeNode n = tree[at(u)];
      if (n.depth() > from.depth() && common_depth(n, from) == from.depth()) {
        below[n.side_at(from.depth())] = true;
      }
    });
    if (below[0] == below[1]) return from;
    from = from.child(below[1] ? 1 : 0);
  }
}

// The deepest of the ancestors of v's node that is on one branch with all neighbours, and from
// there down.
TreeNode repaired_node(const Graph& graph, const DissectionTree& tree, Index v) {
  const TreeNode own = tree[at(v)];
  int depth = own.depth();
  for_neighbours(graph, v, [&](Index u) {
    const TreeNode n = tree[at(u)];
    if (!on_one_branch(own, n)) depth = std::min(depth, common_depth(own, n));
  });
  return lowest_node(graph, tree, v, own.ancestor(depth));
}

// Splits a leaf that has outgrown its kind: `members` come back in their new order, with nodes
// below the leaf's. `local` is kInvalid everywhere, before and after.
void dissect_leaf(const Graph& graph, std::vector<Index>& members, TreeNode leaf,
                  std::vector<Index>& local, DissectionTree& tree,
                  const ExecutionContext& context) {
  std::sort(members.begin(), members.end());
  for (std::size_t i = 0; i < members.size(); ++i) local[at(members[i])] = static_cast<Index>(i);
  Graph part;
  part.offset.push_back(0);
  for (const Index v : members) {
    for_neighbours(graph, v, [&](Index u) {
      if (local[at(u)] != kInvalid) part.neighbour.push_back(local[at(u)]);
    });
    part.offset.push_back(static_cast<Index>(part.neighbour.size()));
  }
  for (const Index v : members) local[at(v)] = kInvalid;
  DissectionTree below;
  const std::vector<Index> order = nested_dissection(part, nullptr, context, &below);
  std::vector<Index> ordered;
  ordered.reserve(order.size());
  for (const Index i : order) {
    TreeNode node = leaf;
    const TreeNode path = below[at(i)];
    for (int d = 0; d < path.depth() && node.depth() < TreeNode::kDeepest; ++d)
      node = node.child(path.side_at(d));
    tree[at(members[at(i)])] = node;
    ordered.push_back(members[at(i)]);
  }
  members.swap(ordered);
}

}  // namespace

std::vector<Index> repair_dissection(const Graph& graph, const std::vector<Index>& before,
                                     DissectionTree& tree, const ExecutionContext& context) {
  const Index count = graph.count();
  context.check();
  // Up: of the two ends of a bad edge the one that ends lower, which widens a shorter separator.
  for (Index v = 0; v < count; ++v) {
    for_neighbours(graph, v, [&](Index u) {
      if (u < v || on_one_branch(tree[at(v)], tree[at(u)])) return;
      const TreeNode for_v = repaired_node(graph, tree, v);
      const TreeNode for_u = repaired_node(graph, tree, u);
      const Index mover = for_v.depth() >= for_u.depth() ? v : u;
      tree[at(mover)] = mover == v ? for_v : for_u;
    });
  }
  context.check();
  // Down: what a move made needless in a separator. Every step lowers a vertex; no cycle.
  std::vector<char> queued(at(count), 0);
  std::vector<Index> stack;
  const auto push = [&](Index v) {
    if (queued[at(v)]) return;
    queued[at(v)] = 1;
    stack.push_back(v);
  };
  for (Index v = count - 1; v >= 0; --v) push(v);
  while (!stack.empty()) {
    const Index v = stack.back();
    stack.pop_back();
    queued[at(v)] = 0;
    const TreeNode lower = lowest_node(graph, tree, v, tree[at(v)]);
    if (lower == tree[at(v)]) continue;
    tree[at(v)] = lower;
    for_neighbours(graph, v, push);
  }
  context.check();

  // Postorder; within a node as before.
  struct Entry {
    std::uint64_t key;
    Index rank;
    bool operator<(const Entry& o) const { return key != o.key ? key < o.key : rank < o.rank; }
  };
  std::vector<Entry> entries(at(count));
  for (Index i = 0; i < count; ++i) entries[at(i)] = {tree[at(before[at(i)])].key(), i};
  std::sort(entries.begin(), entries.end());
  context.check();
  std::vector<Index> order(at(count));
  for (Index i = 0; i < count; ++i) order[at(i)] = before[at(entries[at(i)].rank)];

  // Leaves: nodes with nothing below them.
  std::vector<Index> local(at(count), kInvalid);
  std::vector<std::uint64_t> near;
  std::vector<Index> outside;
  std::vector<Index> members;
  for (Index begin = 0, end = 0; begin < count; begin = end) {
    const TreeNode node = tree[at(order[at(begin)])];
    for (end = begin + 1; end < count && tree[at(order[at(end)])] == node;) ++end;
    const Index width = end - begin;
    const bool leaf = begin == 0 || !on_one_branch(tree[at(order[at(begin) - 1])], node) ||
                      tree[at(order[at(begin) - 1])].depth() < node.depth();
    if (!leaf || width < 2) continue;
    members.assign(order.begin() + begin, order.begin() + end);
    if (width > kMinimumDegreeLimit) {
      dissect_leaf(graph, members, node, local, tree, context);
      std::copy(members.begin(), members.end(), order.begin() + begin);
      continue;
    }
    near.assign(at(width), 0);
    outside.assign(at(width), 0);
    for (Index i = 0; i < width; ++i) local[at(members[at(i)])] = i;
    for (Index i = 0; i < width; ++i) {
      for_neighbours(graph, members[at(i)], [&](Index u) {
        if (local[at(u)] == kInvalid) {
          ++outside[at(i)];
        } else {
          near[at(i)] |= std::uint64_t{1} << local[at(u)];
        }
      });
    }
    const std::vector<Index> inner = minimum_degree(near, outside);
    for (Index i = 0; i < width; ++i) {
      order[at(begin + i)] = members[at(inner[at(i)])];
      local[at(members[at(i)])] = kInvalid;
    }
  }
  return order;
}

}  // namespace flipfree::numeric
