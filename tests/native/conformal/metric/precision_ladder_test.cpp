#include "flipfree/conformal/metric/precision_ladder.h"

#include <gtest/gtest.h>

#include <string>

#include "conformal/engine_inputs.h"
#include "flipfree/base/error.h"

namespace flipfree::conformal::precision_ladder_test {
namespace {

TEST(PrecisionLadder, StaysInDoubleWhereThatSuffices) {
  const mesh::Surface surface = test::torus(16, 12);
  ExecutionContext context;
  const EngineInput input = test::waves(surface, 0.3, context);
  const ConformalMetric metric = climb_precision_ladder(input, {}, context);
  EXPECT_TRUE(metric.converged);
  EXPECT_EQ(metric.bits, 53);
  EXPECT_EQ(metric.end, NewtonEnd::kConverged);
  for (std::size_t v = 0; v < input.target.size(); ++v)
    EXPECT_NEAR(metric.angles[v], input.target[v], 1.1e-10);
  double mean = 0.0;
  for (const double u : metric.scale_factors) mean += u;
  EXPECT_NEAR(mean, 0.0, 1e-9);
}

TEST(PrecisionLadder, MoreBitsFindTheSameMetric) {
  const mesh::Surface surface = test::torus(12, 8);
  ExecutionContext context;
  const EngineInput input = test::waves(surface, 0.3, context);
  const ConformalMetric plain = climb_precision_ladder(input, {}, context);
  MetricOptions options;
  options.bits = 150;
  options.tolerance = 1e-25;
  const ConformalMetric fine = climb_precision_ladder(input, options, context);
  EXPECT_TRUE(fine.converged);
  EXPECT_EQ(fine.bits, 150);
  EXPECT_LT(fine.angle_error, 1e-25);
  for (std::size_t v = 0; v < plain.scale_factors.size(); ++v)
    EXPECT_NEAR(fine.scale_factors[v], plain.scale_factors[v], 1e-8);
}

// Beyond what doubles can tell, more bits are taken, as many as needed.
TEST(PrecisionLadder, ClimbsWhereRoundingDecides) {
  const mesh::Surface surface = test::torus(12, 8);
  ExecutionContext context;
  const EngineInput input = test::waves(surface, 0.3, context);
  MetricOptions options;
  options.tolerance = 1e-18;
  const ConformalMetric metric = climb_precision_ladder(input, options, context);
  EXPECT_TRUE(metric.converged);
  EXPECT_GT(metric.bits, 53);
  EXPECT_LT(metric.angle_error, 1e-18);
  EXPECT_TRUE(metric.stats.contains("climbed_because"));
}

TEST(PrecisionLadder, WhatItDidNotReachIsReturnedOrThrownAsAsked) {
  const mesh::Surface surface = test::torus(12, 8);
  ExecutionContext context;
  const EngineInput input = test::waves(surface, 0.3, context);
  MetricOptions options;
  options.max_iterations = 1;
  options.require_convergence = false;
  const ConformalMetric metric = climb_precision_ladder(input, options, context);
  EXPECT_FALSE(metric.converged);
  EXPECT_EQ(metric.end, NewtonEnd::kIterations);
  EXPECT_GT(metric.angle_error, 1e-10);
  options.require_convergence = true;
  try {
    climb_precision_ladder(input, options, context);
    FAIL() << "went on";
  } catch (const NotConverged& e) {
    EXPECT_EQ(e.error().code, ErrorCode::kIterationLimit);
    EXPECT_NE(e.error().message.find("Spread the curvature"), std::string::npos);
  }
}

TEST(PrecisionLadder, SaysWhatWouldHelp) {
  ConformalMetric metric;
  MetricOptions options;
  const auto cure = [&](NewtonEnd end, int bits) {
    metric.end = end;
    options.bits = bits;
    try {
      throw_not_reached(metric, options);
    } catch (const NotConverged& e) {
      EXPECT_EQ(e.error().code,
                end == NewtonEnd::kSeconds ? ErrorCode::kTimeLimit : ErrorCode::kIterationLimit);
      return e.error().message;
    }
  };
  EXPECT_NE(cure(NewtonEnd::kSeconds, 0).find("max_seconds"), std::string::npos);
  EXPECT_NE(cure(NewtonEnd::kPrecision, 53).find("more bits"), std::string::npos);
  EXPECT_EQ(cure(NewtonEnd::kPrecision, 0).find("more bits"), std::string::npos);
}

}  // namespace
}  // namespace flipfree::conformal::precision_ladder_test
