// Relaxation: nearer to the input's metric, the same angles.
#include "flipfree/seamless/penner/relaxation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "flipfree/intrinsic/loops.h"
#include "flipfree/seamless/penner/penner_metric.h"
#include "support/shapes.h"

namespace flipfree::seamless::relaxation_test {
namespace {

// All negative curvature at one end, far from where the surface has it.
std::vector<Index> crowded_cones(const mesh::Surface& surface, Index genus) {
  std::vector<Index> cones(static_cast<std::size_t>(surface.vertices.rows()), 4);
  for (Index i = 0; i < 8 * genus - 8; ++i) cones[at(3 * i)] = 5;
  return cones;
}

double squares(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double x : values) sum += x * x;
  return sum;
}

TEST(Relaxation, LeadsNearerToTheInputAndKeepsTheAngles) {
  const mesh::Surface surface = test::sphere(24, 16);
  std::vector<Index> cones(static_cast<std::size_t>(surface.vertices.rows()), 4);
  for (Index i = 0; i < 20; ++i) cones[at(3 + i)] = 5;
  for (Index i = 0; i < 28; ++i) cones[at(200 + i)] = 3;
  ExecutionContext context;
  PennerOptions options;
  double before = 0.0;
  for (const int steps : {0, 1, 3}) {
    options.relaxation = steps;
    const PennerMetric result = compute_penner_metric(surface, cones, {}, options, context);
    EXPECT_EQ(result.relaxed, steps);
    EXPECT_LE(result.metric.angle_error, options.tolerance);
    const double distance = squares(
        ReferenceMetric(result.metric).ratios(std::get<std::vector<double>>(result.metric.length)));
    if (steps > 0) {
      EXPECT_LT(distance, 0.8 * before);
    }
    before = distance;
  }
}

TEST(Relaxation, HappensByItselfOnlyWhereTheScaleAsksForIt) {
  ExecutionContext context;
  const mesh::Surface surface = test::perforated_plate(5, 4);
  const auto far = compute_penner_metric(surface, crowded_cones(surface, 5), {}, {}, context);
  EXPECT_GT(far.relaxed, 0);
  const mesh::Surface sphere = test::sphere(16, 12);
  std::vector<Index> cones(static_cast<std::size_t>(sphere.vertices.rows()), 4);
  for (Index i = 0; i < 8; ++i) cones[at(2 + 20 * i)] = 3;
  EXPECT_EQ(compute_penner_metric(sphere, cones, {}, {}, context).relaxed, 0);
}

// Of the input itself there is nothing to say: all ratios are one, through all flips.
TEST(ReferenceMetric, OfAnUnchangedMetricHasNoRatios) {
  const mesh::Surface surface = test::perforated_plate(2, 3);
  ExecutionContext context;
  conformal::EngineInput input;
  input.vertex_count = static_cast<Index>(surface.vertices.rows());
  input.setup = intrinsic::build_intrinsic_mesh(input.vertex_count, surface.faces);
  // Flattened, so that diagonals of squares must be flipped.
  mesh::Surface sheared = surface;
  for (Eigen::Index v = 0; v < sheared.vertices.rows(); ++v)
    sheared.vertices(v, 0) += 0.6 * sheared.vertices(v, 1);
  input.positions = &sheared.vertices;
  input.target.assign(at(input.vertex_count), 6.0);
  const auto engine = conformal::make_engine(input, 53, context);
  conformal::ConformalMetric metric;
  engine->finish(metric, false, context);
  ASSERT_GT(metric.euclidean_flips, 0u);
  for (const double r : ReferenceMetric(metric).ratios(engine->lengths()))
    EXPECT_NEAR(r, 0.0, 1e-12);
}

TEST(ScalingEnergy, IsOneForAnyUniformScale) {
  EXPECT_NEAR(scaling_energy({3.0, 3.0}, {1.0, 2.0}), 1.0, 1e-12);
  // Half of the area doubled: means of 4 and 1, of 1/4 and 1.
  EXPECT_NEAR(scaling_energy({std::log(2.0), 0.0}, {1.0, 1.0}), std::sqrt(2.5 * 0.625), 1e-12);
}

// The shortest of all changes that meet the equations: orthogonal to every change that keeps the
// angles, as the difference of two solutions is.
TEST(ShortestSystem, StepsAreShortestAndMeetTheEquations) {
  mesh::Surface surface = test::perforated_plate(2, 3);
  for (Eigen::Index i = 0; i < surface.vertices.size(); ++i)
    surface.vertices.data()[i] += 0.02 * std::sin(3.7 * static_cast<double>(i));
  ExecutionContext context;
  conformal::EngineInput input;
  input.vertex_count = static_cast<Index>(surface.vertices.rows());
  input.setup = intrinsic::build_intrinsic_mesh(input.vertex_count, surface.faces);
  input.positions = &surface.vertices;
  // Gauss-Bonnet, which the equations need.
  input.target.assign(
      at(input.vertex_count),
      std::numbers::pi * static_cast<double>(surface.faces.rows()) / input.vertex_count);
  const auto engine = conformal::make_engine(input, 53, context);
  const auto& mesh = engine->mesh();
  const intrinsic::FlipMesh& flips = mesh;
  const intrinsic::LoopCarrier loops(
      flips,
      intrinsic::homology_basis(flips, std::vector<double>(mesh.edge_count(), 1.0), context));
  const PennerTargets targets{input.target, std::vector<double>(loops.size(), 0.2)};
  PennerAngles before, after;
  measure(*engine, loops, targets, before, context);
  ShortestSystem system;
  std::vector<double> shortest, other, wish(mesh.edge_count(), 0.0);
  ASSERT_TRUE(system.solve(mesh, loops, before, wish, shortest, context));
  for (std::size_t e = 0; e < wish.size(); ++e) wish[e] = std::cos(2.3 * static_cast<double>(e));
  ASSERT_TRUE(system.solve(mesh, loops, before, wish, other, context));
  double product = 0.0;
  for (std::size_t e = 0; e < wish.size(); ++e) product += shortest[e] * (other[e] - shortest[e]);
  EXPECT_NEAR(product, 0.0, 1e-8 * squares(other));
  EXPECT_LT(squares(shortest), squares(other));
  for (const auto& step : {shortest, other}) {
    auto moved = engine->copy();
    std::vector<double> part = step;
    for (double& x : part) x *= 1e-6;
    moved->stretch(part, context);
    measure(*moved, loops, targets, after, context);
    for (std::size_t v = 0; v < input.target.size(); ++v) {
      EXPECT_NEAR((before.vertices.value[v] - after.vertices.value[v]) / 1e-6,
                  before.vertices.value[v], 5e-3);
    }
    for (std::size_t i = 0; i < loops.size(); ++i)
      EXPECT_NEAR((before.loops[i] - after.loops[i]) / 1e-6, before.loops[i], 5e-3);
  }
}

}  // namespace
}  // namespace flipfree::seamless::relaxation_test
