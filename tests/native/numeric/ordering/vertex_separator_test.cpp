#include "flipfree/numeric/ordering/vertex_separator.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "flipfree/base/error.h"
#include "support/graphs.h"

namespace flipfree::numeric::vertex_separator_test {
namespace {

Subgraph part_of(const Graph& graph) {
  Subgraph part;
  part.offset = graph.offset;
  part.neighbour = graph.neighbour;
  return part;
}

struct Split {
  std::vector<char> side;
  std::vector<Index> sorted;
  std::array<std::int64_t, 3> count() const {
    return {std::count(side.begin(), side.end(), kLeft),
            std::count(side.begin(), side.end(), kRight),
            std::count(side.begin(), side.end(), kSeparator)};
  }
};

// Separates, and checks what is promised of any graph.
Split checked(const Subgraph& part) {
  Split split;
  split.side = separate(part, split.sorted, ExecutionContext());
  EXPECT_EQ(static_cast<Index>(split.side.size()), part.count());
  for (Index v = 0; v < part.count(); ++v) {
    const char mine = split.side[static_cast<std::size_t>(v)];
    EXPECT_TRUE(mine == kLeft || mine == kRight || mine == kSeparator);
    for_neighbours(part, v, [&](Index u) {
      const char other = split.side[static_cast<std::size_t>(u)];
      EXPECT_FALSE((mine == kLeft && other == kRight) || (mine == kRight && other == kLeft));
    });
  }
  if (!split.sorted.empty()) {
    std::vector<Index> sorted = split.sorted;
    std::sort(sorted.begin(), sorted.end());
    for (Index v = 0; v < part.count(); ++v) EXPECT_EQ(sorted[static_cast<std::size_t>(v)], v);
  }
  return split;
}

TEST(VertexSeparator, no_edge_joins_the_sides_of_any_graph) {
  std::mt19937 random(1);
  for (int i = 0; i < 200; ++i) {
    const Index count = 2 + static_cast<Index>(random() % 300);
    Subgraph part = part_of(test::random_graph(
        count, static_cast<int>(random() % (4 * static_cast<unsigned>(count))), random));
    part.ends_first = random() % 2 == 0;
    if (random() % 2 == 0) {
      for (Index v = 0; v < count; ++v)
        part.rank.push_back(
            {static_cast<Index>(random() % 1000), static_cast<Index>(random() % 3)});
    }
    checked(part);
  }
}

TEST(VertexSeparator, components_are_split_without_a_separator) {
  std::set<std::pair<Index, Index>> edges;
  for (Index v = 1; v < 60; ++v) {
    if (v % 20 != 0) edges.emplace(v - 1, v);  // three paths
  }
  const auto [left, right, separator] = checked(part_of(test::graph_of(60, edges))).count();
  EXPECT_EQ(separator, 0);
  EXPECT_GE(std::min(left, right), 20);
}

TEST(VertexSeparator, lattices_are_halved_by_about_their_shorter_side) {
  for (const auto& [columns, rows] : {std::pair{40, 40}, std::pair{100, 12}, std::pair{9, 80}}) {
    for (const bool drawn : {false, true}) {
      Subgraph part = part_of(test::lattice(columns, rows));
      for (Index v = 0; drawn && v < part.count(); ++v)
        part.rank.push_back({v % columns, v / columns});
      const Split split = checked(part);
      const auto [left, right, separator] = split.count();
      EXPECT_LE(separator, 2 * std::min(columns, rows)) << columns << " " << rows << " " << drawn;
      EXPECT_GE(4 * std::min(left, right), part.count() - separator);
      EXPECT_EQ(static_cast<Index>(split.sorted.size()), part.count());
    }
  }
}

TEST(VertexSeparator, stars_and_cliques_have_a_separator_though_no_balanced_cut) {
  std::set<std::pair<Index, Index>> star, clique;
  for (Index v = 1; v < 50; ++v) {
    star.emplace(0, v);
    for (Index u = 0; u < v; ++u) clique.emplace(u, v);
  }
  EXPECT_LE(checked(part_of(test::graph_of(50, star))).count()[2], 49);
  const auto [left, right, separator] = checked(part_of(test::graph_of(50, clique))).count();
  EXPECT_EQ(std::min(left, right), 0) << "two sides of a clique are joined";
  EXPECT_GT(separator, 0);
}

TEST(VertexSeparator, two_vertices_are_enough) {
  checked(part_of(test::graph_of(2, {{0, 1}})));
  EXPECT_EQ(checked(part_of(test::graph_of(2, {}))).count()[2], 0);
}

TEST(VertexSeparator, a_cancelled_one_ends) {
  ExecutionContext context;
  context.cancel();
  std::vector<Index> sorted;
  EXPECT_THROW(separate(part_of(test::lattice(30, 30)), sorted, context), Cancelled);
}

}  // namespace
}  // namespace flipfree::numeric::vertex_separator_test
