#include "flipfree/numeric/ordering/nested_dissection.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>

#include "flipfree/base/parallel.h"
#include "flipfree/numeric/ordering/minimum_degree.h"
#include "flipfree/numeric/ordering/vertex_separator.h"

namespace flipfree::numeric {
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
  for (const Index v : sorted) local[at(v)] = count[static_cast<std::size_t>(side[at(v)])]++;
  Index next = part.begin + count[kLeft] + count[kRight];
  for (const Index v : sorted) {
    if (side[at(v)] != kSeparator) continue;
    order[at(next++)] = part.vertices[at(v)];
    tree[at(part.vertices[at(v)])] = part.node;
  }
  Index begin = part.begin;
  for (const char which : {kLeft, kRight}) {
    const Index n = count[static_cast<std::size_t>(which)];
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

}  // namespace flipfree::numeric
