#include "flipfree/numeric/lobachevsky.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace {

constexpr double kPi = std::numbers::pi;

TEST(Lobachevsky, KnownValues) {
  // 1.0149... is the volume of the regular ideal tetrahedron, 0.9159... Catalan's constant.
  EXPECT_NEAR(flipfree::numeric::lobachevsky(kPi / 3), 1.0149416064096536 / 3, 1e-15);
  EXPECT_NEAR(flipfree::numeric::lobachevsky(kPi / 6), 1.0149416064096536 / 2, 1e-15);
  EXPECT_NEAR(flipfree::numeric::lobachevsky(kPi / 4), 0.915965594177219015 / 2, 1e-15);
  EXPECT_EQ(flipfree::numeric::lobachevsky(0.0), 0.0);
  EXPECT_NEAR(flipfree::numeric::lobachevsky(kPi / 2), 0.0, 1e-15);
}

TEST(Lobachevsky, DoublingFormulaHoldsEverywhere) {
  for (double x = 1e-6; x < kPi / 2; x += 0.0137) {
    const double doubled =
        2 * flipfree::numeric::lobachevsky(x) + 2 * flipfree::numeric::lobachevsky(x + kPi / 2);
    EXPECT_NEAR(flipfree::numeric::lobachevsky(2 * x), doubled, 2e-15) << x;
  }
}

TEST(Lobachevsky, DerivativeIsMinusTheLogarithmOfTwiceTheSine) {
  for (double x = 0.05; x < kPi - 0.05; x += 0.1) {
    const double h = 1e-4;
    const double slope =
        (flipfree::numeric::lobachevsky(x + h) - flipfree::numeric::lobachevsky(x - h)) / (2 * h);
    EXPECT_NEAR(slope, -std::log(2 * std::sin(x)), 1e-5) << x;
  }
}

}  // namespace
