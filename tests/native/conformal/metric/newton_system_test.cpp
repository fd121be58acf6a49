// The Newton direction solves the system it should, with a fresh factor and with an old one.
#include "flipfree/conformal/metric/newton_system.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "support/shapes.h"

namespace flipfree::conformal::newton_system_test {
namespace {

// Largest entry of H d + g, from the gradient's own cotangents; g without its mean.
double residual(const MetricEngine& engine, const Gradient& gradient, const FineVector& d) {
  const intrinsic::IntrinsicMesh& mesh = engine.mesh();
  std::vector<double> r = gradient.value;
  double mean = 0.0;
  for (const double x : r) mean += x / static_cast<double>(r.size());
  for (double& x : r) x -= mean;
  for (std::size_t h = 0; h < mesh.halfedge_count(); h += 2) {
    const auto a = static_cast<std::size_t>(mesh.unknown[at(mesh.origin[h])]);
    const auto b = static_cast<std::size_t>(mesh.unknown[at(mesh.origin[h + 1])]);
    const double weight = gradient.half_cotangent[h] + gradient.half_cotangent[h + 1];
    const double low_a = d.low.empty() ? 0.0 : d.low[a], low_b = d.low.empty() ? 0.0 : d.low[b];
    const double flow = weight * ((d.high[a] - d.high[b]) + (low_a - low_b));
    r[a] += flow;
    r[b] -= flow;
  }
  double largest = 0.0;
  for (const double x : r) largest = std::max(largest, std::abs(x));
  return largest;
}

TEST(NewtonSystem, old_factors_serve_near_the_solution_and_only_there) {
  const mesh::Surface surface = test::sphere(24, 17);
  ExecutionContext context;
  EngineInput input;
  input.vertex_count = static_cast<Index>(surface.vertices.rows());
  input.setup = intrinsic::build_intrinsic_mesh(input.vertex_count, surface.faces);
  input.positions = &surface.vertices;
  input.target.assign(static_cast<std::size_t>(input.vertex_count), 0.0);
  const auto engine = make_engine(input, 53, context);
  Gradient gradient;
  engine->evaluate(1e-13, gradient, context);
  std::vector<double> angles(gradient.value.size());
  for (std::size_t v = 0; v < angles.size(); ++v) angles[v] = -gradient.value[v];

  // Targets that differ from the angles by waves of this height.
  const auto set_error = [&](double height) {
    for (std::size_t v = 0; v < angles.size(); ++v)
      gradient.value[v] = height * std::sin(0.9 * static_cast<double>(v));
    gradient.max_error = height;
  };
  NewtonSystem system;
  FineVector d;
  set_error(1.0);
  ASSERT_TRUE(system.solve(engine->mesh(), gradient, 53, d, context));
  EXPECT_EQ(system.factorizations(), 1);
  EXPECT_LE(residual(*engine, gradient, d), 1e-8);

  // A metric a little further on, with another pattern as well.
  FineVector step = d;
  for (double& x : step.high) x *= 0.1;
  step.low.clear();
  engine->scale(step, context);
  ASSERT_TRUE(engine->restore_delaunay(context));
  Gradient moved;
  engine->evaluate(1e-13, moved, context);
  gradient.half_cotangent = moved.half_cotangent;
  set_error(0.01);
  ASSERT_TRUE(system.solve(engine->mesh(), gradient, 53, d, context));
  EXPECT_EQ(system.factorizations(), 1);
  EXPECT_GT(system.old_factor_solves(), 0);
  EXPECT_LE(residual(*engine, gradient, d), 0.11 * 0.01 * 0.01);  // falls with the square

  set_error(1.0);
  ASSERT_TRUE(system.solve(engine->mesh(), gradient, 53, d, context));
  EXPECT_EQ(system.factorizations(), 2);
  EXPECT_LE(residual(*engine, gradient, d), 1e-8);
}

// What needles may make of a gradient: no direction, and no access to one that is not there.
TEST(NewtonSystem, refuses_cotangents_and_angles_that_are_no_numbers_or_join_nothing) {
  const mesh::Surface surface = test::tetrahedron();
  ExecutionContext context;
  EngineInput input;
  input.vertex_count = static_cast<Index>(surface.vertices.rows());
  input.setup = intrinsic::build_intrinsic_mesh(input.vertex_count, surface.faces);
  input.positions = &surface.vertices;
  input.target.assign(static_cast<std::size_t>(input.vertex_count), std::numbers::pi);
  const auto engine = make_engine(input, 53, context);
  Gradient good;
  engine->evaluate(1e-13, good, context);
  good.value[0] += 0.1;
  good.value[1] -= 0.1;
  good.max_error = 0.1;
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  FineVector d;
  ASSERT_TRUE(NewtonSystem().solve(engine->mesh(), good, 53, d, context));
  for (const double bad : {0.0, -1.0, kNan, kInfinity, 1e308}) {
    for (const std::size_t count : {std::size_t{1}, good.half_cotangent.size()}) {
      Gradient gradient = good;
      std::fill_n(gradient.half_cotangent.begin(), count, bad);
      FineVector direction;  // nobody has sized it yet
      const bool solved = NewtonSystem().solve(engine->mesh(), gradient, 53, direction, context);
      if (!solved) continue;
      EXPECT_LT(count, gradient.half_cotangent.size()) << bad;
      for (const double x : direction.high) EXPECT_TRUE(std::isfinite(x)) << bad;
    }
  }
  for (const double bad : {kNan, kInfinity}) {
    Gradient gradient = good;
    gradient.value[2] = bad;
    for (const double error : {0.1, kInfinity}) {
      gradient.max_error = error;
      FineVector direction;
      EXPECT_FALSE(NewtonSystem().solve(engine->mesh(), gradient, 53, direction, context));
    }
  }
}

}  // namespace
}  // namespace flipfree::conformal::newton_system_test
