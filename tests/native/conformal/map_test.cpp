#include "flipfree/conformal/map.h"

#include <gtest/gtest.h>

#include <numbers>
#include <numeric>
#include <random>

#include "support/shapes.h"

namespace flipfree::conformal::map_test {
namespace {

using std::numbers::pi;

// A quarter turn of angle at the poles, three at two others.
std::vector<double> quarter_cones(const mesh::Surface& sphere) {
  std::vector<double> target(static_cast<std::size_t>(sphere.vertices.rows()), 2.0 * pi);
  target.front() = target.back() = 0.5 * pi;
  target[5] = target[20] = 1.5 * pi;
  return target;
}

std::vector<double> random_angles(const mesh::Surface& closed) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> uniform(pi, 3.0 * pi);
  std::vector<double> target(static_cast<std::size_t>(closed.vertices.rows()));
  for (double& t : target) t = uniform(random);
  const double sum = std::accumulate(target.begin(), target.end(), 0.0);
  for (double& t : target) t *= pi * static_cast<double>(closed.faces.rows()) / sum;
  return target;
}

TEST(ConformalMap, ASphereWithConesIsCertifiedAndLeavesNoFailure) {
  const mesh::Surface surface = test::sphere(10, 8);
  ExecutionContext context;
  const ConformalMapResult result =
      conformal_map(surface, nullptr, quarter_cones(surface), {}, context);
  ASSERT_FALSE(result.failure) << result.failure->message;
  EXPECT_TRUE(result.metric.converged);
  EXPECT_EQ(result.metric.end, NewtonEnd::kConverged);
  EXPECT_TRUE(result.map.certificate.ok);
  EXPECT_EQ(result.map.certificate.flips64, 0);
  EXPECT_EQ(result.map.certificate.flips32, 0);
  EXPECT_GT(result.map.cut_edges.rows(), 0);
  EXPECT_EQ(result.map.surface.vertices.topRows(surface.vertices.rows()), surface.vertices);
}

TEST(ConformalMap, PointsAreAddedOnlyWhereTheyAreAllowed) {
  const mesh::Surface surface = test::sphere(10, 8);
  const std::vector<double> target = random_angles(surface);
  ExecutionContext context;
  ConformalMapOptions options;
  const ConformalMapResult refined = conformal_map(surface, nullptr, target, options, context);
  ASSERT_FALSE(refined.failure) << refined.failure->message;
  EXPECT_GT(refined.map.surface.vertices.rows(), surface.vertices.rows());
  EXPECT_TRUE(refined.map.certificate.ok);
  options.refinement = intrinsic::Refinement::kNever;
  const ConformalMapResult whole = conformal_map(surface, nullptr, target, options, context);
  ASSERT_TRUE(whole.failure);
  EXPECT_EQ(whole.failure->code, ErrorCode::kCertificateFailed);
  EXPECT_EQ(whole.failure->kind, ElementKind::kFace);
  EXPECT_FALSE(whole.failure->elements.empty());
  EXPECT_EQ(whole.map.surface.faces, surface.faces);
  EXPECT_FALSE(whole.map.certificate.ok);
}

TEST(ConformalMap, CutsThatAreNoEdgesAreRefusedBeforeTheWork) {
  const mesh::Surface surface = test::sphere(10, 8);
  ExecutionContext context;
  ConformalMapOptions options;
  options.cuts.resize(1, 2);
  options.cuts << 0, static_cast<Index>(surface.vertices.rows()) - 1;
  EXPECT_THROW(conformal_map(surface, nullptr, quarter_cones(surface), options, context),
               InvalidInput);
  EXPECT_STREQ(context.stage(), "");
}

}  // namespace
}  // namespace flipfree::conformal::map_test
