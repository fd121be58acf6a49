#include "flipfree/conformal/suggest_cones.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "flipfree/conformal/metric.h"
#include "support/shapes.h"

namespace flipfree::conformal::suggest_cones_test {
namespace {

using std::numbers::pi;

TEST(SuggestCones, TheBoundHoldsOnTheMetricOfTheAngles) {
  const mesh::Surface surface = test::sphere(14, 10);
  ExecutionContext context;
  SuggestConesOptions options;
  options.bound = 3.0;
  const SuggestedCones cones = suggest_cones(surface, options, context);
  EXPECT_TRUE(cones.bound_holds);
  EXPECT_LE(cones.scale_ratio, options.bound);
  EXPECT_GE(cones.cones.size(), 2u);
  EXPECT_NEAR(std::accumulate(cones.target_angles.begin(), cones.target_angles.end(), 0.0),
              pi * static_cast<double>(surface.faces.rows()), 1e-9);
  const ConformalMetric metric =
      compute_conformal_metric(surface, cones.target_angles, {}, context);
  EXPECT_NEAR(std::exp(metric.scale_range), cones.scale_ratio, 1e-6 * cones.scale_ratio);
  for (std::size_t v = 0; v < cones.target_angles.size(); ++v) {
    const bool is_cone = std::find(cones.cones.begin(), cones.cones.end(),
                                   static_cast<VertexId>(v)) != cones.cones.end();
    if (!is_cone) {
      EXPECT_NEAR(cones.target_angles[v], 2.0 * pi, 1e-9);
    }
  }
}

TEST(SuggestCones, CurvaturesAreMultiplesOfTheQuantum) {
  const mesh::Surface surface = test::sphere(12, 8);
  ExecutionContext context;
  SuggestConesOptions options;
  options.quantum = 0.5 * pi;
  const SuggestedCones cones = suggest_cones(surface, options, context);
  for (const double angle : cones.target_angles) {
    const double quanta = (2.0 * pi - angle) / options.quantum;
    EXPECT_NEAR(quanta, std::round(quanta), 1e-9);
  }
}

}  // namespace
}  // namespace flipfree::conformal::suggest_cones_test
