#include "flipfree/numeric/ordering/minimum_degree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

namespace flipfree::numeric::minimum_degree_test {
namespace {

// The elimination game on sets: eliminating a vertex joins all its neighbours. Every vertex of the
// order must have had the least degree of those left, and be the first of them.
void expect_minimum_degree(const std::vector<std::set<Index>>& graph,
                           const std::vector<Index>& outside) {
  std::vector<std::uint64_t> near(graph.size(), 0);
  for (std::size_t v = 0; v < graph.size(); ++v) {
    for (const Index u : graph[v]) near[v] |= std::uint64_t{1} << u;
  }
  const std::vector<Index> order = minimum_degree(near, outside);
  ASSERT_EQ(order.size(), graph.size());
  std::vector<std::set<Index>> game = graph;
  std::set<Index> left;
  for (std::size_t v = 0; v < graph.size(); ++v) left.insert(static_cast<Index>(v));
  const auto degree = [&](Index v) {
    return static_cast<Index>(game[static_cast<std::size_t>(v)].size()) +
           outside[static_cast<std::size_t>(v)];
  };
  for (const Index v : order) {
    const Index best = *std::min_element(left.begin(), left.end(), [&](Index a, Index b) {
      return degree(a) != degree(b) ? degree(a) < degree(b) : a < b;
    });
    ASSERT_EQ(v, best);
    left.erase(v);
    const std::set<Index> clique = game[static_cast<std::size_t>(v)];
    for (const Index u : clique) {
      auto& mine = game[static_cast<std::size_t>(u)];
      mine.insert(clique.begin(), clique.end());
      mine.erase(u);
      mine.erase(v);
    }
  }
  EXPECT_TRUE(left.empty());
}

TEST(MinimumDegree, every_vertex_had_the_least_degree_when_its_turn_came) {
  std::mt19937 random(1);
  for (int i = 0; i < 300; ++i) {
    const Index count = i < 20 ? kMinimumDegreeLimit : 1 + static_cast<Index>(random() % 64);
    const auto n = static_cast<std::size_t>(count);
    std::vector<std::set<Index>> graph(n);
    for (unsigned long e = random() % (1 + 4 * n); e > 0; --e) {
      const auto a = static_cast<Index>(random() % n), b = static_cast<Index>(random() % n);
      if (a == b) continue;
      graph[static_cast<std::size_t>(a)].insert(b);
      graph[static_cast<std::size_t>(b)].insert(a);
    }
    std::vector<Index> outside(n);
    for (Index& o : outside) o = static_cast<Index>(random() % 4);
    expect_minimum_degree(graph, outside);
  }
}

TEST(MinimumDegree, neighbours_outside_count) {
  // A path 0 - 1 - 2 whose ends have many neighbours outside: the middle goes first.
  std::vector<std::uint64_t> near = {2, 5, 2};
  EXPECT_EQ(minimum_degree(near, {9, 0, 9}).front(), 1);
}

TEST(MinimumDegree, of_nothing_is_nothing) {
  std::vector<std::uint64_t> near;
  EXPECT_TRUE(minimum_degree(near, {}).empty());
}

}  // namespace
}  // namespace flipfree::numeric::minimum_degree_test
