// Bringing a metric nearer to that of the input.
#include "flipfree/seamless/padding/disks/near_metric.h"

#include <gtest/gtest.h>

#include <numbers>

#include "flipfree/conformal/metric/metric.h"
#include "support/shapes.h"

namespace flipfree::seamless::near_metric_test {
namespace {

TEST(NearMetric, EveryCallLeavesTheAnglesAndShortensTheDistance) {
  const mesh::Surface surface = test::sphere(20, 14);
  std::vector<double> angle(static_cast<std::size_t>(surface.vertices.rows()),
                            2.0 * std::numbers::pi);
  for (std::size_t i = 0; i < 8; ++i) angle[3 + 5 * i] = 1.5 * std::numbers::pi;
  ExecutionContext context;
  const auto conformal = conformal::compute_conformal_metric(surface, angle, {}, context);
  conformal::EngineInput input;
  input.setup = {conformal.mesh, conformal.input_halfedge, conformal.on_boundary};
  input.vertex_count = static_cast<Index>(angle.size());
  input.edge_length = intrinsic::to_doubles(conformal.length);
  input.target = angle;
  CarriedMetric metric{
      make_engine(input, 53, context), {conformal.mesh, {}}, ReferenceMetric(conformal)};
  ASSERT_TRUE(metric.engine->flips().empty());
  const double before = metric.distance();
  const PennerTargets targets{angle, {}};
  EXPECT_GT(come_near(metric, targets, 1e-8, 3, 1.0, context), 0);
  EXPECT_LT(metric.distance(), before);
  PennerAngles angles;
  measure(*metric.engine, metric.loops, targets, angles, context);
  EXPECT_LE(angles.max_error, 1e-8);
  EXPECT_EQ(come_near(metric, targets, 1e-8, 0, 1.0, context), 0);
}

}  // namespace
}  // namespace flipfree::seamless::near_metric_test
