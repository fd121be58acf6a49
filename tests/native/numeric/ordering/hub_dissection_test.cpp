#include "flipfree/numeric/nested_dissection.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "support/graphs.h"

namespace flipfree::numeric::hub_dissection_test {
namespace {

// Entries of the factor below its diagonal, by the elimination game.
std::size_t fill(const Graph& graph, const std::vector<Index>& order) {
  const auto n = static_cast<std::size_t>(graph.count());
  std::vector<std::size_t> position(n);
  for (std::size_t k = 0; k < n; ++k) position[static_cast<std::size_t>(order[k])] = k;
  std::vector<std::set<std::size_t>> later(n);
  for (std::size_t k = 0; k < n; ++k) {
    for_neighbours(graph, order[k], [&](Index u) {
      if (position[static_cast<std::size_t>(u)] > k)
        later[k].insert(position[static_cast<std::size_t>(u)]);
    });
  }
  std::size_t entries = 0;
  for (std::size_t k = 0; k < n; ++k) {
    entries += later[k].size();
    if (later[k].empty()) continue;
    const std::size_t parent = *later[k].begin();
    later[parent].insert(std::next(later[k].begin()), later[k].end());
  }
  return entries;
}

// A hub is one more entry in every column at worst; distances through it say nothing.
TEST(HubDissection, hubs_that_make_everything_near_hardly_add_to_the_fill) {
  const Index side = 64, spacing = 8;
  Graph graph = test::lattice(side, side);
  const ExecutionContext context;
  const double without =
      static_cast<double>(fill(graph, nested_dissection(graph, nullptr, context)));
  std::vector<std::vector<Index>> neighbours(static_cast<std::size_t>(side * side + 3));
  for (Index v = 0; v < side * side; ++v) {
    std::vector<Index>& own = neighbours[static_cast<std::size_t>(v)];
    for_neighbours(graph, v, [&](Index u) { own.push_back(u); });
    if (v % spacing > 2) continue;
    const Index hub = side * side + v % spacing;
    own.push_back(hub);
    neighbours[static_cast<std::size_t>(hub)].push_back(v);
  }
  graph = {{0}, {}};
  for (const std::vector<Index>& own : neighbours) {
    graph.neighbour.insert(graph.neighbour.end(), own.begin(), own.end());
    graph.offset.push_back(static_cast<Index>(graph.neighbour.size()));
  }
  DissectionTree tree;
  std::vector<Index> order = hub_dissection(graph, nullptr, context, tree);
  EXPECT_LT(static_cast<double>(fill(graph, order)), 1.1 * without + 3.0 * graph.count());
  for (Index v = 0; v < graph.count(); ++v) {
    for_neighbours(graph, v, [&](Index u) {
      EXPECT_TRUE(
          on_one_branch(tree[static_cast<std::size_t>(v)], tree[static_cast<std::size_t>(u)]));
    });
  }
  std::sort(order.begin(), order.end());
  for (Index v = 0; v < graph.count(); ++v) ASSERT_EQ(order[static_cast<std::size_t>(v)], v);
}

}  // namespace
}  // namespace flipfree::numeric::hub_dissection_test
