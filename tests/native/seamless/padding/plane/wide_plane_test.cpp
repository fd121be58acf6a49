// Vectors of wide numbers: quarter turns without rounding.
#include "flipfree/seamless/padding/plane/wide_plane.h"

#include <gtest/gtest.h>

namespace flipfree::seamless::wide_plane_test {
namespace {

TEST(WidePlane, QuarterTurnsAreExactAndFoundAgain) {
  const WideVector a{Wide(3.0), Wide(0.25)};
  for (Index k = -4; k < 8; ++k) {
    const WideVector b = turned(a, k);
    EXPECT_TRUE(dot(b, b) == dot(a, a));
    EXPECT_EQ(turns_between(a, b), (k + 4) % 4);
  }
  EXPECT_TRUE(cross(a, turned(a, 1)) == dot(a, a));
}

TEST(WidePlane, HoldsWhatDoublesLose) {
  const Wide tiny(1e-50, kWideBits), one(1.0);
  EXPECT_TRUE((one + tiny) - one > Wide(0.999e-50));
}

}  // namespace
}  // namespace flipfree::seamless::wide_plane_test
