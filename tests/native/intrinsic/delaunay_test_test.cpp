#include "flipfree/intrinsic/delaunay_test.h"

#include <gtest/gtest.h>

#include <cmath>

#include "flipfree/numeric/scalar.h"

namespace flipfree::intrinsic::delaunay_test_test {
namespace {

using numeric::BigFloat;

TEST(DelaunayTest, SignsOfKitesAreThoseOfTheirAngles) {
  const double side = std::sqrt(0.5);
  EXPECT_EQ(delaunay_sign(1.0, 1.0, 1.0, 1.0, 1.0), 1);
  EXPECT_EQ(delaunay_sign(1.0, 0.6, 0.6, 0.6, 0.6), -1);
  EXPECT_EQ(delaunay_sign(1.0, side, side, side, side), 0);
  EXPECT_FALSE(violates_delaunay_in_full(1.0, 1.0, 1.0, 1.0, 1.0, 53));
  EXPECT_TRUE(violates_delaunay_in_full(1.0, 0.6, 0.6, 0.6, 0.6, 53));
}

// Roundings of 2048 bits are no doubles: they must not be taken for violations.
TEST(DelaunayTest, ARoundingIsNoViolationWithAnyNumberOfBits) {
  using Number = BigFloat<64>;
  for (const int bits : {53, 128, 1024, 2048, 4096}) {
    const Number one(1.0, bits);
    const Number rounding = Number::power_of_two(1 - bits, bits);
    const Number half = Number(0.5, bits);
    const Number side = sqrt(half) * (one - rounding);
    EXPECT_FALSE(violates_delaunay_in_full(one, side, side, side, side, bits)) << bits;
    const Number beyond = sqrt(half) * (one - Number(64.0, bits) * rounding);
    EXPECT_TRUE(violates_delaunay_in_full(one, beyond, beyond, beyond, beyond, bits)) << bits;
  }
}

}  // namespace
}  // namespace flipfree::intrinsic::delaunay_test_test
