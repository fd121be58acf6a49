#include "flipfree/conformal/refined_metric.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <numbers>
#include <variant>
#include <vector>

#include "flipfree/base/error.h"
#include "support/shapes.h"

namespace flipfree::conformal::refined_metric_test {
namespace {

// A sphere, one of whose triangles is divided by a vertex very near one of its edges: a needle.
mesh::Surface with_needle() {
  mesh::Surface surface = test::sphere(12, 9);
  const Eigen::Index f = 40;
  const VertexId a = surface.faces(f, 0), b = surface.faces(f, 1), c = surface.faces(f, 2);
  const auto v = static_cast<VertexId>(surface.vertices.rows());
  surface.vertices.conservativeResize(v + 1, 3);
  surface.vertices.row(v) = (0.5 - 1e-4) * (surface.vertices.row(a) + surface.vertices.row(b)) +
                            2e-4 * surface.vertices.row(c);
  const Eigen::Index m = surface.faces.rows();
  surface.faces.conservativeResize(m + 2, 3);
  surface.faces.row(f) << a, b, v;
  surface.faces.row(m) << b, c, v;
  surface.faces.row(m + 1) << c, a, v;
  return surface;
}

std::vector<double> four_cones(const mesh::Surface& surface) {
  std::vector<double> target(static_cast<std::size_t>(surface.vertices.rows()),
                             2 * std::numbers::pi);
  for (const std::size_t v : {1U, 20U, 50U, 80U}) target[v] = std::numbers::pi;
  return target;
}

TEST(RefinedMetric, AddsVerticesThatAreFlatAndMeetsAllAngles) {
  const mesh::Surface surface = test::torus(5, 40);  // faces many times longer than wide
  std::vector<double> target(static_cast<std::size_t>(surface.vertices.rows()),
                             2 * std::numbers::pi);
  target[1] = std::numbers::pi;
  target[100] = 3 * std::numbers::pi;
  ExecutionContext context;
  const RefinedMetric refined = compute_refined_metric(surface, nullptr, target, {}, true, context);
  ASSERT_NE(refined.split, nullptr);
  const ConformalMetric& metric = refined.metric;
  EXPECT_TRUE(metric.converged);
  ASSERT_FALSE(metric.added.empty());
  ASSERT_EQ(metric.angles.size(), target.size() + metric.added.size());
  for (std::size_t v = 0; v < metric.angles.size(); ++v)
    EXPECT_NEAR(metric.angles[v], v < target.size() ? target[v] : 2 * std::numbers::pi, 1e-9);
  EXPECT_EQ(std::get<std::int64_t>(metric.stats.at("intrinsic_refinement")),
            static_cast<std::int64_t>(metric.added.size()));
}

TEST(RefinedMetric, OfASurfaceWithoutBadTrianglesThereIsNone) {
  const mesh::Surface surface = test::tetrahedron();
  const std::vector<double> target(4, std::numbers::pi);
  ExecutionContext context;
  EXPECT_EQ(compute_refined_metric(surface, nullptr, target, {}, true, context).split, nullptr);
}

TEST(RefinedMetric, BothWaysFailingTheErrorIsThatOfThePlainOne) {
  const mesh::Surface surface = with_needle();
  const std::vector<double> target = four_cones(surface);
  ExecutionContext context;
  MetricOptions options;
  options.max_iterations = 0;
  EXPECT_THROW(compute_refined_metric(surface, nullptr, target, options, true, context),
               NotConverged);
  options.require_convergence = false;
  for (const bool wish : {false, true}) {
    const RefinedMetric metric =
        compute_refined_metric(surface, nullptr, target, options, wish, context);
    EXPECT_EQ(metric.split, nullptr);
    EXPECT_FALSE(metric.metric.converged);
    EXPECT_EQ(metric.metric.end, NewtonEnd::kIterations);
  }
}

}  // namespace
}  // namespace flipfree::conformal::refined_metric_test
