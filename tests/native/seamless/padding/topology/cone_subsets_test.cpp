// Subsets of cones with a given sum, against all subsets.
#include "flipfree/seamless/padding/topology/cone_subsets.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

namespace flipfree::seamless::cone_subsets_test {
namespace {

TEST(ConeSubsets, AreFoundWhereverThereAreAny) {
  std::mt19937 random(3);
  for (int run = 0; run < 200; ++run) {
    std::vector<Index> cones;
    for (int i = 0; i < 8; ++i) cones.push_back(1 + static_cast<Index>(random() % 12));
    std::set<Index> sums;
    for (unsigned mask = 1; mask < 256; ++mask) {
      Index sum = 0;
      for (unsigned i = 0; i < 8; ++i) {
        if ((mask >> i & 1u) != 0) sum += cones[i] - 4;
      }
      sums.insert(sum);
    }
    for (Index excess = -30; excess <= 70; ++excess) {
      if (excess == 0) continue;
      const auto found = cones_with_excess(cones, excess);
      ASSERT_EQ(found.has_value(), sums.contains(excess)) << excess;
      if (!found) continue;
      Index sum = 0;
      for (const VertexId v : *found) sum += cones[static_cast<std::size_t>(v)] - 4;
      EXPECT_EQ(sum, excess);
      EXPECT_EQ(std::set<VertexId>(found->begin(), found->end()).size(), found->size());
    }
  }
}

TEST(ConeSubsets, FlatVerticesAreNoCones) {
  EXPECT_EQ(cones_with_excess({4, 4, 6, 4}, 2), std::vector<VertexId>{2});
  EXPECT_FALSE(cones_with_excess({4, 4, 4}, 1).has_value());
}

}  // namespace
}  // namespace flipfree::seamless::cone_subsets_test
