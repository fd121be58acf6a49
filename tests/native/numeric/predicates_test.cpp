#include "flipfree/numeric/predicates.h"

#include <gtest/gtest.h>

#include <limits>

#include <boost/multiprecision/gmp.hpp>
#include <cmath>
#include <random>

namespace flipfree::numeric::predicates_test {
namespace {

using Rational = boost::multiprecision::mpq_rational;

int exact_orientation(const Vector2& a, const Vector2& b, const Vector2& c) {
  const Rational determinant =
      (Rational(b.x()) - Rational(a.x())) * (Rational(c.y()) - Rational(a.y())) -
      (Rational(b.y()) - Rational(a.y())) * (Rational(c.x()) - Rational(a.x()));
  return determinant.sign();
}

TEST(Orientation, agrees_with_rational_arithmetic_on_nearly_collinear_points) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int i = 0; i < 20000; ++i) {
    const Vector2 a(unit(random), unit(random));
    const Vector2 b(unit(random), unit(random));
    Vector2 c = a + unit(random) * (b - a);
    if (i % 3 == 0) c.x() = std::nextafter(c.x(), 2.0);
    EXPECT_EQ(orientation(a, b, c), exact_orientation(a, b, c));
  }
}

TEST(Orientation, is_exact_at_extreme_scales) {
  for (const int exponent : {-1070, -600, -300, 0, 300, 600, 1020}) {
    const double s = std::ldexp(1.0, exponent);
    const Vector2 a(s, s);
    const Vector2 b(2 * s, 2 * s);
    const Vector2 c(3 * s, 3 * s);
    const Vector2 above(3 * s, std::nextafter(3 * s, std::numeric_limits<double>::infinity()));
    EXPECT_EQ(orientation(a, b, c), 0) << exponent;
    EXPECT_EQ(orientation(a, b, above), 1) << exponent;
    EXPECT_EQ(orientation(b, a, above), -1) << exponent;
  }
}

TEST(Orientation, of_floats_is_that_of_the_same_numbers_as_doubles) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> unit(0.0F, 1.0F);
  for (int i = 0; i < 5000; ++i) {
    float p[6];
    for (float& x : p) x = unit(random);
    p[4] = p[0] + 0.5F * (p[2] - p[0]);
    p[5] = p[1] + 0.5F * (p[3] - p[1]);
    EXPECT_EQ(orientation(p, p + 2, p + 4),
              exact_orientation({p[0], p[1]}, {p[2], p[3]}, {p[4], p[5]}));
  }
}

TEST(InCircle, knows_the_corners_of_a_square_as_cocircular) {
  EXPECT_EQ(in_circle({0, 0}, {1, 0}, {1, 1}, {0, 1}), 0);
  EXPECT_EQ(in_circle({0, 0}, {1, 0}, {1, 1}, {0.5, 0.5}), 1);
  EXPECT_EQ(in_circle({0, 0}, {1, 0}, {1, 1}, {0, std::nextafter(1.0, 2.0)}), -1);
}

TEST(TwoProduct, is_exact_in_all_of_its_range_and_off_by_little_below) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> one_to_two(1.0, 2.0);
  std::uniform_int_distribution<int> exponent(-1074, 995);
  const Rational least(std::numeric_limits<double>::denorm_min());
  int exact = 0;
  int below = 0;
  for (int i = 0; i < 200000; ++i) {
    const int power = exponent(random);
    // Beside products of all sizes, as many near the lower bound as near the upper one.
    const int other = i % 3 == 0 ? exponent(random) : (i % 3 == 1 ? 1021 : -970) - power;
    if (other < -1074 || other > 995 || power + other > 1021) continue;
    const double x = std::ldexp(one_to_two(random), power);
    const double y = std::ldexp(i % 2 == 0 ? one_to_two(random) : -one_to_two(random), other);
    const Pair product = two_product(x, y);
    const Rational error =
        abs(Rational(x) * Rational(y) - Rational(product.high) - Rational(product.low));
    if (std::abs(product.high) >= std::ldexp(1.0, -969)) {
      ASSERT_EQ(error, 0) << x << " " << y;
      ++exact;
    } else {
      ASSERT_LT(error, 4 * least) << x << " " << y;
      ++below;
    }
  }
  EXPECT_GT(exact, 50000);
  EXPECT_GT(below, 10000);
}

TEST(SegmentsConflict, tells_crossings_touches_and_shared_ends_apart) {
  const Vector2 o(0, 0);
  EXPECT_TRUE(segments_conflict({-1, 0}, {1, 0}, {0, -1}, {0, 1})) << "crossing";
  EXPECT_TRUE(segments_conflict({-1, 0}, {1, 0}, o, {0, 1})) << "end inside the other segment";
  EXPECT_TRUE(segments_conflict(o, {2, 0}, o, {1, 0})) << "collinear overlap from a shared end";
  EXPECT_TRUE(segments_conflict(o, {2, 0}, {1, 0}, {3, 0})) << "collinear overlap";
  EXPECT_TRUE(segments_conflict(o, {1, 0}, {1, 0}, o)) << "the same segment";
  EXPECT_FALSE(segments_conflict(o, {1, 0}, o, {0, 1})) << "shared end only";
  EXPECT_FALSE(segments_conflict(o, {1, 0}, {1, 0}, {2, 0})) << "collinear, shared end only";
  EXPECT_FALSE(segments_conflict(o, {1, 0}, {2, 0}, {3, 0})) << "collinear, apart";
  EXPECT_FALSE(segments_conflict(o, {1, 0}, {0, 1}, {1, 1})) << "parallel";
  EXPECT_FALSE(segments_conflict(o, {1, 0}, {2, -1}, {2, 1})) << "its line alone is crossed";
  EXPECT_FALSE(segments_conflict({2, -1}, {2, 1}, o, {1, 0})) << "the other's line alone";
}

TEST(Predicates, SayNothingOfWhatIsNotFinite) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  const Vector2 a(0, 0);
  const Vector2 b(1, 0);
  const Vector2 c(0, 1);
  for (const double bad : {nan, infinity, -infinity}) {
    for (const Vector2& p : {Vector2(bad, 0.5), Vector2(0.5, bad), Vector2(bad, bad)}) {
      EXPECT_EQ(orientation(a, b, p), 0);
      EXPECT_EQ(orientation(p, b, c), 0);
      EXPECT_EQ(in_circle(a, b, c, p), 0);
    }
  }
}

}  // namespace
}  // namespace flipfree::numeric::predicates_test
