#include "flipfree/conformal/pinned_metric.h"

#include <gtest/gtest.h>

#include <numbers>
#include <numeric>

#include "support/shapes.h"

namespace flipfree::conformal::pinned_metric_test {
namespace {

using std::numbers::pi;

// Flat inside, u = 0 on the boundary.
PinnedMetric flattened(const mesh::Surface& surface, const std::vector<char>& pinned) {
  ExecutionContext context;
  const std::vector<double> flat(pinned.size(), 2.0 * pi);
  return compute_pinned_metric(surface, flat, pinned, 1e-10, context);
}

std::vector<char> boundary_of(const mesh::Surface& surface) {
  const auto setup =
      intrinsic::build_intrinsic_mesh(static_cast<Index>(surface.vertices.rows()), surface.faces);
  return {setup.on_boundary.begin(), setup.on_boundary.end()};
}

TEST(PinnedMetric, ABumpIsFlattenedAndTheBoundaryBearsTheRest) {
  const mesh::Surface surface = test::bumpy_grid(10, 9, 0.3, 2.0);
  const std::vector<char> pinned = boundary_of(surface);
  const PinnedMetric metric = flattened(surface, pinned);
  ASSERT_TRUE(metric.converged);
  double sum = 0.0;
  double most = 0.0;
  for (std::size_t v = 0; v < pinned.size(); ++v) {
    sum += metric.angles[v];
    most = std::max(most, std::abs(metric.u[v]));
    if (pinned[v]) {
      EXPECT_EQ(metric.u[v], 0.0);
    } else {
      EXPECT_EQ(metric.angles[v], 2.0 * pi);
    }
  }
  EXPECT_GT(most, 0.1);
  // Every triangle has the angle sum pi.
  EXPECT_NEAR(sum, pi * static_cast<double>(surface.faces.rows()), 1e-8);
}

}  // namespace
}  // namespace flipfree::conformal::pinned_metric_test
