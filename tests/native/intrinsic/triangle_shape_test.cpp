#include "flipfree/intrinsic/delaunay_test.h"

#include <gtest/gtest.h>

#include <cmath>

namespace flipfree::intrinsic::triangle_shape_test {
namespace {

using numeric::BigFloat;

TEST(TriangleShape, HalfTangentsOfTheEgyptianTriangle) {
  // 3, 4, 5: the inner radius is 1, so tan of half the angles is 1 / (6 - side).
  const TriangleShape shape = shape_in_full(3.0, 4.0, 5.0, 53);
  EXPECT_NEAR(shape.half_tangent(0), 1.0 / 3.0, 1e-15);
  EXPECT_NEAR(shape.half_tangent(1), 1.0 / 2.0, 1e-15);
  EXPECT_NEAR(shape.half_tangent(2), 1.0, 1e-15);
  EXPECT_NEAR(half_tangent_square(3.0, 4.0, 5.0), 1.0 / 9.0, 1e-15);
}

TEST(TriangleShape, NeedlesKeepTheirSmallAngleWithMoreBits) {
  // Height 2^-40 over the middle of a base of length 2, sides sqrt(1 + 2^-80): the angles beside
  // the base are atan(2^-40), which doubles cannot tell from nothing.
  const int bits = 200;
  const double height = std::ldexp(1.0, -40);
  const BigFloat<4> square(height * height, bits);
  const BigFloat<4> side = sqrt(BigFloat<4>(1.0, bits) + square);
  const TriangleShape shape = shape_in_full(BigFloat<4>(2.0, bits), side, side, bits);
  const double expected = std::tan(0.5 * std::atan(height));
  EXPECT_NEAR(shape.half_tangent(1), expected, 1e-14 * expected);
  EXPECT_NEAR(shape.half_tangent(2), expected, 1e-14 * expected);
  EXPECT_FALSE(rounded_lengths_serve(shape_in_full(2.0, 1.0, 1.0, 53).x, 1e-3));
}

// 2^-2048 is no double.
TEST(TriangleShape, ABrokenTriangleInequalityReadsAsBarelyValidWithAnyNumberOfBits) {
  using Number = BigFloat<32>;
  const int bits = 2048;
  const TriangleShape shape =
      shape_in_full(Number(3.0, bits), Number(1.0, bits), Number(1.0, bits), bits);
  for (int k = 0; k < 3; ++k) {
    EXPECT_GT(shape.x[k], 0.0);
    EXPECT_TRUE(std::isfinite(shape.half_tangent(k)));
  }
  EXPECT_GT(shape.half_tangent(0), 1e7);
}

TEST(TriangleShape, RoundedLengthsServeWhereNoDifferenceIsSmall) {
  double x[3];
  perimeter_differences(1.0, 1.0, 1.0, x);
  for (const double difference : x) EXPECT_NEAR(difference, 1.0 / 3.0, 1e-15);
  EXPECT_TRUE(rounded_lengths_serve(x, 1e-14));
  EXPECT_FALSE(rounded_lengths_serve(x, 1e-16));
}

}  // namespace
}  // namespace flipfree::intrinsic::triangle_shape_test
