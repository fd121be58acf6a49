// Compiled with every optimisation there is, the vectorizer that drops conversions among them
// (tests/native/CMakeLists.txt).
#include "flipfree/base/plane.h"

#include <gtest/gtest.h>

#include <cstring>
#include <random>

namespace flipfree::stored_test {
namespace {

// Has no more than the 24 bits of a float: what the low half of a double's fraction says.
bool is_a_float(double x) {
  std::uint64_t bits = 0;
  std::memcpy(&bits, &x, sizeof bits);
  return (bits & ((std::uint64_t{1} << 29) - 1)) == 0;
}

// Pairs, next to each other: what a straight-line vectorizer looks for.
void round_pairs(const double* in, double* out, std::size_t pairs) {
  for (std::size_t i = 0; i < pairs; ++i) {
    out[2 * i] = as_stored(in[2 * i]);
    out[2 * i + 1] = as_stored(in[2 * i + 1]);
  }
}

TEST(AsStored, no_conversion_is_dropped_whatever_the_optimiser_does) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> any(-8, 8);
  Points2 points(10000, 2);
  for (Eigen::Index i = 0; i < points.size(); ++i) points.data()[i] = any(random);
  Points2 rounded(points.rows(), 2);
  round_pairs(points.data(), rounded.data(), at(points.rows()));
  EXPECT_EQ(rounded, as_stored(points));
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    const Vector2 p = points.row(i).transpose();
    const Vector2 stored = as_stored(p);
    EXPECT_EQ(stored.transpose(), rounded.row(i));
    for (const double x : {stored.x(), stored.y()}) ASSERT_TRUE(is_a_float(x)) << x;
    ASSERT_LE((stored - p).cwiseAbs().maxCoeff(), 0x1p-22) << "the nearest float";
  }
}

}  // namespace
}  // namespace flipfree::stored_test
