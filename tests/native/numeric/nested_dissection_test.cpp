#include "flipfree/numeric/nested_dissection.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "support/graphs.h"

namespace flipfree::numeric::nested_dissection_test {
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

TEST(NestedDissection, is_an_order_of_all_vertices) {
  std::mt19937 random(1);
  for (int i = 0; i < 60; ++i) {
    const Index count = 1 + static_cast<Index>(random() % 700);
    // From scattered vertices to a dense graph.
    const Graph graph = test::random_graph(
        count, static_cast<int>(random() % (3 * static_cast<unsigned>(count))), random);
    const std::vector<Index> order = nested_dissection(graph, ExecutionContext());
    std::vector<Index> sorted = order;
    std::sort(sorted.begin(), sorted.end());
    for (Index v = 0; v < count; ++v) ASSERT_EQ(sorted[static_cast<std::size_t>(v)], v);
  }
}

TEST(NestedDissection, threads_change_nothing) {
  const Graph graph = test::lattice(90, 70);
  std::vector<std::vector<Index>> orders;
  for (const int threads : {1, 2, 4}) {
    ExecutionContext context;
    context.threads = threads;
    orders.push_back(nested_dissection(graph, context));
  }
  EXPECT_EQ(orders[0], orders[1]);
  EXPECT_EQ(orders[0], orders[2]);
}

// George 1973: a lattice of n vertices has a factor of about 31/4 n log2 n; elimination row by row
// n^(3/2).
TEST(NestedDissection, fills_lattices_far_less_than_elimination_row_by_row) {
  const Index side = 64;
  const Graph graph = test::lattice(side, side);
  std::vector<Index> rows(static_cast<std::size_t>(side * side));
  for (std::size_t v = 0; v < rows.size(); ++v) rows[v] = static_cast<Index>(v);
  const double by_rows = static_cast<double>(fill(graph, rows));
  const double entries =
      static_cast<double>(fill(graph, nested_dissection(graph, ExecutionContext())));
  EXPECT_LT(entries, 0.4 * by_rows);
  EXPECT_LT(entries, 7.75 * side * side * 12.0);
}

}  // namespace
}  // namespace flipfree::numeric::nested_dissection_test
