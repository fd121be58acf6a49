#include "flipfree/certify/measures.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "fuzz/rational.h"

namespace flipfree::certify::flips_test {
namespace {

// What rational numbers say.
std::vector<FaceId> expected(const Points2& uv) {
  std::vector<FaceId> flipped;
  for (FaceId f = 0; f < uv.rows() / 3; ++f) {
    const auto at = [&](Index k) { return fuzz::exact(uv.row(3 * f + k).transpose()); };
    if (fuzz::side(at(0), at(1), at(2)) <= 0) flipped.push_back(f);
  }
  return flipped;
}

// Triangles whose third corner lies on the line of the others but for rounding.
Points2 thin_triangles(Index count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> place(-3.0, 3.0);
  Points2 uv(3 * count, 2);
  for (Index f = 0; f < count; ++f) {
    uv.middleRows<2>(3 * f) << place(random), place(random), place(random), place(random);
    uv.row(3 * f + 2) = uv.row(3 * f) + place(random) * (uv.row(3 * f + 1) - uv.row(3 * f));
  }
  return uv;
}

TEST(Flips, are_those_of_rational_numbers_in_64_and_in_32_bits) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    const Points2 uv = thin_triangles(400, seed);
    const std::vector<FaceId> flipped = expected(uv);
    EXPECT_GT(flipped.size(), 100U);
    EXPECT_LT(flipped.size(), 300U);
    EXPECT_EQ(flipped_faces(uv), flipped);
    const Points2f stored = uv.cast<float>();
    EXPECT_EQ(flipped_faces(stored), expected(stored.cast<double>()));
  }
}

TEST(Flips, size_does_not_matter) {
  for (const double unit : {1e-300, 1e-150, 1e150, 1e300}) {
    const Points2 uv = unit * thin_triangles(200, 7);
    EXPECT_EQ(flipped_faces(uv), expected(uv)) << unit;
  }
}

TEST(Flips, what_is_not_finite_is_flipped) {
  const double wrong[] = {std::numeric_limits<double>::infinity(),
                          -std::numeric_limits<double>::infinity(),
                          std::numeric_limits<double>::quiet_NaN()};
  for (const double x : wrong) {
    for (Index i = 0; i < 6; ++i) {
      Points2 uv(9, 2);
      for (Index f = 0; f < 3; ++f) uv.middleRows<3>(3 * f) << 0, 0, 1, 0, 0, 1;
      uv(3 + i / 2, i % 2) = x;
      EXPECT_EQ(flipped_faces(uv), std::vector<FaceId>{1});
      EXPECT_EQ(flipped_faces(Points2f(uv.cast<float>())), std::vector<FaceId>{1});
    }
  }
}

}  // namespace
}  // namespace flipfree::certify::flips_test
