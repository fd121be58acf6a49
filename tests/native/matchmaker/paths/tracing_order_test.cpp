#include "flipfree/matchmaker/paths/tracing_order.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <vector>

#include "flipfree/matchmaker/paths/outline_tree.h"

namespace flipfree::matchmaker::tracing_order_test {
namespace {

// A square with so many points inside.
TargetDomain square(const std::vector<Vector2>& inner) {
  const Polygon outline = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  return triangulate_embedded(outline, inner, {});
}

const std::vector<Vector2> kPoints = {{0.2, 0.3}, {0.5, 0.5}, {0.8, 0.4}, {0.4, 0.8}, {0.7, 0.75}};

// Does the first edge that reaches every point come before one that closes a loop with it?
TEST(TracingOrder, JoinsEveryPointToTheOutlineBeforeItClosesLoops) {
  const TargetDomain domain = square(kPoints);
  const ConvexPartition partition = unmerged(domain);
  const std::vector<bool> settled(partition.edges.size(), false);
  const std::vector<Index> order = tracing_order(domain, partition, settled);
  std::set<Index> once(order.begin(), order.end());
  EXPECT_EQ(once.size(), order.size());
  const auto inner = std::count_if(partition.edges.begin(), partition.edges.end(),
                                   [](const auto& e) { return !e.boundary; });
  EXPECT_EQ(static_cast<std::ptrdiff_t>(order.size()), inner);
  std::set<Index> reached(domain.outline.begin(), domain.outline.end());
  for (std::size_t i = 0; i < kPoints.size(); ++i) {
    const auto& edge = partition.edges[static_cast<std::size_t>(order[i])];
    EXPECT_NE(reached.contains(edge.a), reached.contains(edge.b)) << i;
    reached.insert(edge.a);
    reached.insert(edge.b);
  }
  EXPECT_EQ(reached.size(), domain.point.size());
}

TEST(TracingOrder, LeavesOutWhatIsSettled) {
  const TargetDomain domain = square(kPoints);
  const ConvexPartition partition = unmerged(domain);
  std::vector<bool> settled(partition.edges.size(), false);
  const std::vector<Index> all = tracing_order(domain, partition, settled);
  settled[static_cast<std::size_t>(all.front())] = true;
  const std::vector<Index> rest = tracing_order(domain, partition, settled);
  EXPECT_EQ(rest.size() + 1, all.size());
  EXPECT_EQ(std::count(rest.begin(), rest.end(), all.front()), 0);
}

// Lengths that grow while the tree does: the shortest at the time is taken, not the one that was.
TEST(OutlineTree, TakesTheShortestEdgeAsItIsNow) {
  const TargetDomain domain = square(kPoints);
  const ConvexPartition partition = unmerged(domain);
  const std::vector<bool> settled(partition.edges.size(), false);
  std::vector<double> taken;
  const auto least = [](Index e) { return static_cast<double>(e); };
  const auto now = [&](Index e) {
    return static_cast<double>(e) + 3.0 * static_cast<double>(taken.size());
  };
  join_to_outline(domain, partition, settled, least, now,
                  [&](Index e, double) { taken.push_back(now(e)); });
  EXPECT_EQ(taken.size(), kPoints.size());
}

}  // namespace
}  // namespace flipfree::matchmaker::tracing_order_test
