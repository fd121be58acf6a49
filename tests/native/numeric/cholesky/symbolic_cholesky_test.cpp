#include "flipfree/numeric/cholesky/symbolic_cholesky.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "support/graphs.h"

namespace flipfree::numeric::symbolic_cholesky_test {
namespace {

// What the header draws, on random graphs under random orders.
TEST(SymbolicCholesky, supernodes_partition_the_columns_and_parents_hold_their_rows) {
  std::mt19937 random(7);
  for (int i = 0; i < 80; ++i) {
    const Index n = 1 + static_cast<Index>(random() % 250);
    const Graph graph =
        test::random_graph(n, static_cast<int>(random() % (3 * static_cast<unsigned>(n))), random);
    std::vector<Index> order(at(n));
    for (Index v = 0; v < n; ++v) order[at(v)] = v;
    std::shuffle(order.begin(), order.end(), random);
    const Supernodes s = analyze_supernodes(graph, order, ExecutionContext());
    ASSERT_EQ(s.order.size(), at(n));
    for (Index k = 0; k < n; ++k) EXPECT_EQ(s.position[at(s.order[at(k)])], k);
    EXPECT_EQ(s.first.front(), 0);
    EXPECT_EQ(s.first.back(), n);
    for (Index node = 0; node < s.count(); ++node) {
      EXPECT_GE(s.columns(node), 1);
      for (Index k = s.first[at(node)]; k < s.first[at(node) + 1]; ++k)
        EXPECT_EQ(s.of_column[at(k)], node);
      const auto begin = s.rows.begin() + s.rows_begin[at(node)];
      const auto end = s.rows.begin() + s.rows_begin[at(node) + 1];
      EXPECT_TRUE(std::is_sorted(begin, end));
      EXPECT_EQ(std::adjacent_find(begin, end), end);
      const Index parent = s.parent[at(node)];
      if (begin == end) {
        EXPECT_EQ(parent, kInvalid);
        continue;
      }
      EXPECT_GE(*begin, s.first[at(node) + 1]);
      ASSERT_EQ(parent, s.of_column[at(*begin)]);
      EXPECT_GT(parent, node);
      // Each row stands in the parent's front at its `relative` place.
      for (auto row = begin; row != end; ++row) {
        const Index place = s.relative[static_cast<std::size_t>(row - s.rows.begin())];
        ASSERT_LT(place, s.columns(parent) + s.rows_below(parent));
        const Index there = place < s.columns(parent)
                                ? s.first[at(parent)] + place
                                : s.rows[static_cast<std::size_t>(s.rows_begin[at(parent)]) +
                                         at(place - s.columns(parent))];
        EXPECT_EQ(there, *row);
      }
    }
  }
}

TEST(SymbolicCholesky, an_order_without_fill_gets_none) {
  // A path from end to end, and a star from its rays to its centre.
  std::set<std::pair<Index, Index>> path, star;
  std::vector<Index> order;
  for (Index v = 0; v < 200; ++v) {
    order.push_back(v);
    if (v > 0) path.emplace(v - 1, v);
    if (v < 199) star.emplace(v, 199);
  }
  for (const auto& edges : {path, star}) {
    const Supernodes s = analyze_supernodes(test::graph_of(200, edges), order, ExecutionContext());
    std::int64_t entries = 0;
    for (Index node = 0; node < s.count(); ++node) {
      const std::int64_t c = s.columns(node);
      entries += c * (c - 1) / 2 + c * s.rows_below(node);
    }
    // Merging small supernodes pays with some zeros.
    EXPECT_LT(entries, 199 * 20);
  }
}

TEST(SymbolicCholesky, StructuresContainTheEliminationGame) {
  // Naive elimination on a small random graph must only fill entries that the supernodes have room
  // for.
  std::mt19937 random(5);
  const Index n = 120;
  std::vector<std::vector<char>> adjacent(n, std::vector<char>(n, 0));
  for (int e = 0; e < 240; ++e) {
    const auto a = random() % n;
    const auto b = random() % n;
    if (a != b) adjacent[a][b] = adjacent[b][a] = 1;
  }
  Graph graph;
  graph.offset = {0};
  for (Index v = 0; v < n; ++v) {
    for (Index u = 0; u < n; ++u) {
      if (adjacent[static_cast<std::size_t>(v)][static_cast<std::size_t>(u)])
        graph.neighbour.push_back(u);
    }
    graph.offset.push_back(static_cast<Index>(graph.neighbour.size()));
  }
  const ExecutionContext context;
  const Supernodes s =
      analyze_supernodes(graph, nested_dissection(graph, nullptr, context), context);
  for (std::size_t k = 0; k < n; ++k) {
    const auto v = static_cast<std::size_t>(s.order[k]);
    const auto node = static_cast<std::size_t>(s.of_column[k]);
    std::vector<std::size_t> later;
    for (std::size_t u = 0; u < n; ++u) {
      const Index row = s.position[u];
      if (!adjacent[v][u] || row <= static_cast<Index>(k)) continue;
      later.push_back(u);
      const bool in_block = row < s.first[node + 1];
      const bool in_rows = std::binary_search(s.rows.begin() + s.rows_begin[node],
                                              s.rows.begin() + s.rows_begin[node + 1], row);
      EXPECT_TRUE(in_block || in_rows);
    }
    for (const auto a : later) {
      for (const auto b : later) {
        if (a != b) adjacent[a][b] = 1;
      }
    }
  }
}

}  // namespace
}  // namespace flipfree::numeric::symbolic_cholesky_test
