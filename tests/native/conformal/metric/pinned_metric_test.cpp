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

TEST(PinnedMetric, AFlatSurfaceStaysAsItIs) {
  const mesh::Surface surface = test::grid(6, 5);
  const PinnedMetric metric = flattened(surface, boundary_of(surface));
  EXPECT_TRUE(metric.converged);
  for (const double u : metric.u) EXPECT_NEAR(u, 0.0, 1e-12);
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

TEST(PinnedLaplacian, SolvesWithAZeroAtPins) {
  ExecutionContext context;
  const mesh::Surface surface = test::grid(4, 4);
  const std::vector<char> pinned = boundary_of(surface);
  EngineInput input;
  input.vertex_count = static_cast<Index>(surface.vertices.rows());
  input.setup = intrinsic::build_intrinsic_mesh(input.vertex_count, surface.faces);
  input.positions = &surface.vertices;
  input.target.assign(pinned.size(), 2.0 * pi);
  const auto engine = make_double_engine(input, context);
  Gradient gradient;
  engine->evaluate(1e-13, gradient, context);
  const PinnedLaplacian laplacian(engine->mesh(), gradient, pinned, context);
  ASSERT_TRUE(laplacian.valid());
  // On a regular grid with unit right angles the cotan Laplacian is the five-point stencil: of the
  // nine inner vertices, a unit charge in the middle is felt as 3 / 8 there, 1 / 8 beside it.
  std::vector<double> charge(pinned.size(), 0.0);
  charge[12] = 1.0;
  const std::vector<double> x = laplacian.solve(charge, context);
  EXPECT_NEAR(x[12], 3.0 / 8.0, 1e-12);
  for (const std::size_t v : {7u, 11u, 13u, 17u}) EXPECT_NEAR(x[v], 1.0 / 8.0, 1e-12);
  for (std::size_t v = 0; v < pinned.size(); ++v) {
    if (pinned[v]) {
      EXPECT_EQ(x[v], 0.0);
    }
  }
}

}  // namespace
}  // namespace flipfree::conformal::pinned_metric_test
