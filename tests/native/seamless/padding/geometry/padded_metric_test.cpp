// Padded metrics: seamless up to the errors of their pieces, flips and all.
#include "flipfree/seamless/padding/geometry/padded_metric.h"

#include <gtest/gtest.h>

#include "flipfree/seamless/penner/penner_metric.h"
#include "seamless/padding/geometry/hand_cuts.h"

namespace flipfree::seamless::padded_metric_test {
namespace {

void expect_seamless(const test::ConedCut& cut, PaddedMetric& padded) {
  EXPECT_EQ(intrinsic::find_broken_invariant(padded.metric), "");
  ExecutionContext context;
  PennerOptions options;
  options.relaxation = 0;
  const PennerMetric finished =
      finish_penner_metric(cut.cut.surface, cut.cones, padded.metric, options, context);
  // There already, before Newton's method.
  EXPECT_LT(finished.metric.error_history.front(), 1e-7);
  EXPECT_LE(finished.metric.angle_error, 1e-10);
}

TEST(PaddedMetric, SquareNeedsNoPadding) {
  const test::ConedCut cut = test::square_cut(test::GridTorus(8, 8));
  ExecutionContext context;
  PaddedMetric padded = compute_padded_metric(cut.cut, cut.cones, context);
  EXPECT_EQ(padded.components, 1);
  EXPECT_EQ(padded.segments, 4u);
  EXPECT_LT(padded.largest_width, 1e-8);
  expect_seamless(cut, padded);
}

TEST(PaddedMetric, TwoAndSixOnATorus) {
  const test::ConedCut cut = test::digon_cut();
  ExecutionContext context;
  PaddedMetric padded = compute_padded_metric(cut.cut, cut.cones, context);
  EXPECT_EQ(padded.components, 2);
  EXPECT_EQ(padded.segments, 8u);
  EXPECT_GT(padded.largest_width, 0.0);
  expect_seamless(cut, padded);
}

TEST(PaddedMetric, ComesNearAndStaysSeamless) {
  const test::ConedCut cut = test::digon_cut();
  ExecutionContext context;
  PaddedMetric padded = compute_padded_metric(cut.cut, cut.cones, context);
  ASSERT_TRUE(come_near(cut.cut, cut.cones, 0, 1.0, padded, context));
  const double before = padded.energy;
  ASSERT_TRUE(come_near(cut.cut, cut.cones, 8, 1.0, padded, context));
  EXPECT_GT(padded.steps, 0);
  EXPECT_LT(padded.energy, before);
  expect_seamless(cut, padded);
}

}  // namespace
}  // namespace flipfree::seamless::padded_metric_test
