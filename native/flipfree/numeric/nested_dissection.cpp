#include "flipfree/numeric/nested_dissection.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <numeric>

#include "flipfree/base/parallel.h"
#include "flipfree/numeric/vertex_separator.h"

namespace flipfree::numeric {

std::vector<Index> minimum_degree(std::vector<std::uint64_t>& near,
                                  const std::vector<Index>& outside) {
  const auto count = static_cast<Index>(near.size());
  std::vector<Index> order;
  order.reserve(near.size());
  std::uint64_t left = count == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << count) - 1;
  while (left != 0) {
    Index best = kInvalid;
    Index best_degree = 0;
    for (std::uint64_t set = left; set != 0; set &= set - 1) {
      const Index v = std::countr_zero(set);
      const Index degree = std::popcount(near[at(v)]) + outside[at(v)];
      if (best == kInvalid || degree < best_degree) {
        best = v;
        best_degree = degree;
      }
    }
    order.push_back(best);
    left &= ~(std::uint64_t{1} << best);
    const std::uint64_t clique = near[at(best)];
    for (std::uint64_t set = clique; set != 0; set &= set - 1) {
      const Index u = std::countr_zero(set);
      near[at(u)] |= clique;
      near[at(u)] &= ~((std::uint64_t{1} << u) | (std::uint64_t{1} << best));
    }
  }
  return order;
}

namespace {

constexpr Index kLeaf = kMinimumDegreeLimit;

// A subgraph with local numbers, and where its vertices go in the order.
struct Part : Subgraph {
  std::vector<Index> vertices;  // local -> vertex of the whole graph
  std::vector<Index> outside;   // neighbours already in separators
  Index begin = 0;              // first elimination position
  TreeNode node;
};

std::vector<Index> leaf_order(const Part& part) {
  std::vector<std::uint64_t> near(at(part.count()), 0);
  for (Index v = 0; v < part.count(); ++v) {
    for_neighbours(part, v, [&](Index u) { near[at(v)] |= std::uint64_t{1} << u; });
  }
  return minimum_degree(near, part.outside);
}

// The vertices of one side as a part of their own, numbered in the order `sorted`.
Part extract(const Part& part, const std::vector<char>& side, char which,
             const std::vector<Index>& sorted, const std::vector<Index>& local, Index count) {
  Part child;
  child.neighbour.reserve(part.neighbour.size() * at(count) / at(part.count()) + 64);
  child.vertices.reserve(at(count));
  child.outside.reserve(at(count));
  child.offset.reserve(at(count) + 1);
  child.offset.push_back(0);
  if (!part.rank.empty()) child.rank.reserve(at(count));
  for (const Index v : sorted) {
    if (side[at(v)] != which) continue;
    child.vertices.push_back(part.vertices[at(v)]);
    if (!part.rank.empty()) child.rank.push_back(part.rank[at(v)]);
    Index outside = part.outside[at(v)];
    for_neighbours(part, v, [&](Index u) {
      if (side[at(u)] == which) {
        child.neighbour.push_back(local[at(u)]);
      } else {
        ++outside;
      }
    });
    child.outside.push_back(outside);
    child.offset.push_back(static_cast<Index>(child.neighbour.size()));
  }
  return child;
}

// Orders a leaf, or orders the separator of a part and leaves its two sides in `children`.
void dissect(Part& part, std::vector<Index>& order, DissectionTree& tree,
             std::vector<Part>& children, const ExecutionContext& context) {
  if (part.count() <= kLeaf) {
    Index next = part.begin;
    for (const Index v : leaf_order(part)) order[at(next++)] = part.vertices[at(v)];
    for (const Index v : part.vertices) tree[at(v)] = part.node;
    return;
  }
  std::vector<Index> sorted;
  const std::vector<char> side = separate(part, sorted, context);
  context.check();
  const bool ends_first = !sorted.empty();
  if (!ends_first) {
    sorted.resize(at(part.count()));
    std::iota(sorted.begin(), sorted.end(), 0);
  }
  std::vector<Index> local(at(part.count()));
  std::array<Index, 3> count{0, 0, 0};
  for (const Index v : sorted) local[at(v)] = count[at(side[at(v)])]++;
  Index next = part.begin + count[kLeft] + count[kRight];
  for (const Index v : sorted) {
    if (side[at(v)] != kSeparator) continue;
    order[at(next++)] = part.vertices[at(v)];
    tree[at(part.vertices[at(v)])] = part.node;
  }
  Index begin = part.begin;
  for (const char which : {kLeft, kRight}) {
    const Index n = count[at(which)];
    if (n == 0) continue;
    children.push_back(extract(part, side, which, sorted, local, n));
    children.back().ends_first = ends_first;
    children.back().begin = begin;
    // Beyond the deepest node that can be named the whole subtree counts as one.
    children.back().node =
        part.node.depth() < TreeNode::kDeepest ? part.node.child(which) : part.node;
    begin += n;
    context.check();
  }
}

std::vector<std::array<Index, 2>> ranks(Index count, const double* places,
                                        const ExecutionContext& context) {
  std::vector<std::array<Index, 2>> rank(at(count));
  parallel_for(context, 2, 1, [&](std::size_t axis, std::size_t, std::size_t) {
    std::vector<Index> order(at(count));
    std::iota(order.begin(), order.end(), 0);
    std::sort(order.begin(), order.end(), [&](Index a, Index b) {
      const double x = places[2 * at(a) + axis];
      const double y = places[2 * at(b) + axis];
      return x != y ? x < y : a < b;
    });
    for (Index i = 0; i < count; ++i) rank[at(order[at(i)])][axis] = i;
  });
  return rank;
}

}  // namespace

std::vector<Index> nested_dissection(const Graph& graph, const double* places,
                                     const ExecutionContext& context, DissectionTree* tree) {
  std::vector<Index> order(at(graph.count()));
  DissectionTree own;
  DissectionTree& nodes = tree != nullptr ? *tree : own;
  nodes.assign(at(graph.count()), TreeNode());
  if (graph.count() == 0) return order;
  std::vector<Part> parts(1);
  Part& root = parts.front();
  root.vertices.resize(at(graph.count()));
  std::iota(root.vertices.begin(), root.vertices.end(), 0);
  root.offset = graph.offset;
  root.neighbour = graph.neighbour;
  root.outside.assign(at(graph.count()), 0);
  if (places != nullptr) root.rank = ranks(graph.count(), places, context);

  // All parts of a level at once. Parts below kSubtree are taken to their leaves by one task.
  constexpr Index kSubtree = 4096;
  while (!parts.empty()) {
    std::vector<std::vector<Part>> children(parts.size());
    parallel_for(context, parts.size(), 1, [&](std::size_t p, std::size_t, std::size_t) {
      std::vector<Part> stack;
      stack.push_back(std::move(parts[p]));
      while (!stack.empty()) {
        Part part = std::move(stack.back());
        stack.pop_back();
        dissect(part, order, nodes, part.count() > kSubtree ? children[p] : stack, context);
      }
    });
    parts.clear();
    for (auto& group : children) {
      for (Part& part : group) parts.push_back(std::move(part));
    }
  }
  return order;
}

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

namespace {

// A hub has so many neighbours, and so many times the mean; in smaller graphs there are none.
constexpr Index kLeastHub = 40;
constexpr double kHub = 8.0;
constexpr Index kGraphWithHubs = 1024;

std::vector<Index> hubs_of(const Graph& graph) {
  std::vector<Index> hubs;
  if (graph.count() < kGraphWithHubs) return hubs;
  const double mean = static_cast<double>(graph.neighbour.size()) / graph.count();
  const Index least = std::max(kLeastHub, static_cast<Index>(kHub * mean));
  for (Index v = 0; v < graph.count(); ++v) {
    if (graph.offset[at(v) + 1] - graph.offset[at(v)] >= least) hubs.push_back(v);
  }
  return hubs;
}

// Vertices with neighbours everywhere make all others near to each other, and no distance tells
// where a small separator is. So the others are dissected without them; then each goes as far down
// the tree as its neighbours let it.
std::vector<Index> dissect_without(const std::vector<Index>& hubs, const Graph& graph,
                                   const double* places, const ExecutionContext& context,
                                   DissectionTree& nodes) {
  std::vector<Index> local(at(graph.count()), 0), others;
  for (const Index v : hubs) local[at(v)] = kInvalid;
  for (Index v = 0; v < graph.count(); ++v) {
    if (local[at(v)] == kInvalid) continue;
    local[at(v)] = static_cast<Index>(others.size());
    others.push_back(v);
  }
  Graph rest;
  rest.offset.push_back(0);
  rest.neighbour.reserve(graph.neighbour.size());
  std::vector<double> own_places;
  for (const Index v : others) {
    for_neighbours(graph, v, [&](Index u) {
      if (local[at(u)] != kInvalid) rest.neighbour.push_back(local[at(u)]);
    });
    rest.offset.push_back(static_cast<Index>(rest.neighbour.size()));
    for (std::size_t axis = 0; places != nullptr && axis < 2; ++axis)
      own_places.push_back(places[2 * at(v) + axis]);
  }
  DissectionTree own;
  std::vector<Index> order =
      nested_dissection(rest, places == nullptr ? nullptr : own_places.data(), context, &own);
  nodes.assign(at(graph.count()), TreeNode());
  for (std::size_t i = 0; i < others.size(); ++i) nodes[at(others[i])] = own[i];
  for (Index& v : order) v = others[at(v)];
  order.insert(order.end(), hubs.begin(), hubs.end());
  return repair_dissection(graph, order, nodes, context);
}

}  // namespace

std::vector<Index> hub_dissection(const Graph& graph, const double* places,
                                  const ExecutionContext& context, DissectionTree& tree) {
  const std::vector<Index> hubs = hubs_of(graph);
  return hubs.empty() ? nested_dissection(graph, places, context, &tree)
                      : dissect_without(hubs, graph, places, context, tree);
}

}  // namespace flipfree::numeric
