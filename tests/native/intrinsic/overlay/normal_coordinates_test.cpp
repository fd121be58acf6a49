#include "flipfree/intrinsic/overlay/normal_coordinates.h"

#include <gtest/gtest.h>

#include <random>

namespace flipfree::intrinsic::normal_coordinates_test {
namespace {

TEST(NormalCoordinates, StrandsOfATriangleAddUpToItsCrossings) {
  std::mt19937 random(3);
  std::uniform_int_distribution<std::int64_t> uniform(0, 40);
  for (int i = 0; i < 2000; ++i) {
    // What turns around the corners, and what emanates from one of them.
    std::int64_t at_u = uniform(random), at_v = uniform(random), at_p = uniform(random);
    const std::int64_t out = uniform(random) % 3, corner = uniform(random) % 3;
    // Nothing turns around a corner where a curve starts.
    if (out > 0) (corner == 0 ? at_p : corner == 1 ? at_v : at_u) = 0;
    const std::int64_t uv = at_u + at_v + (corner == 0 ? out : 0);
    const std::int64_t up = at_u + at_p + (corner == 1 ? out : 0);
    const std::int64_t vp = at_v + at_p + (corner == 2 ? out : 0);
    const Strands strands(uv, up, vp);
    EXPECT_EQ(strands.at_u + strands.end_p + strands.at_v, uv);
    EXPECT_EQ(strands.at_u + strands.end_v + strands.at_p, up);
    EXPECT_EQ(strands.at_v + strands.end_u + strands.at_p, vp);
    // At most one corner has curves that start in it.
    EXPECT_LE((strands.end_p > 0) + (strands.end_u > 0) + (strands.end_v > 0), 1);
  }
}

TEST(NormalCoordinates, AnEdgeThatIsACurveIsCrossedByItOnceAfterAFlip) {
  const FlippedCrossings after = after_flip({0, 0, 0, 0, 0, true});
  EXPECT_EQ(after.count, 1);
  EXPECT_FALSE(after.along);
}

TEST(NormalCoordinates, ACurveFromApexToApexBecomesTheEdge) {
  const FlippedCrossings after = after_flip({1, 0, 0, 0, 0, false});
  EXPECT_EQ(after.count, 0);
  EXPECT_TRUE(after.along);
}

TEST(NormalCoordinates, ParallelCurvesAcrossTheQuadrilateral) {
  // Seven from side ki to side lj, through ij: they cross kl as well. Seven from ki to il do not.
  EXPECT_EQ(after_flip({7, 0, 7, 0, 7, false}).count, 7);
  EXPECT_EQ(after_flip({7, 0, 7, 7, 0, false}).count, 0);
  // Around k, never crossing ij.
  EXPECT_EQ(after_flip({0, 7, 7, 0, 0, false}).count, 7);
}

}  // namespace
}  // namespace flipfree::intrinsic::normal_coordinates_test
