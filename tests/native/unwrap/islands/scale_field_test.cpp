#include "flipfree/unwrap/islands/islands.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "support/shapes.h"

namespace flipfree::unwrap::scale_field_test {
namespace {

TEST(ScaleField, is_zero_on_flat_surfaces_and_at_open_vertices) {
  const mesh::Surface sheet = test::grid(6, 6);
  std::vector<char> open(49, 0);
  for (VertexId v = 0; v < 49; ++v)
    open[static_cast<std::size_t>(v)] = v % 7 % 6 == 0 || v / 7 % 6 == 0 ? 1 : 0;
  ExecutionContext context;
  for (const double u : ScaleField(sheet).solve(open, context)) EXPECT_NEAR(u, 0.0, 1e-12);
}

// On a sphere of radius 1 that is open at one pole only up to a small circle of radius r around it:
// u = log((1 + cos a) / (1 + cos r)) in the angle a from the other pole, so log(2 / (1 - cos r)).
TEST(ScaleField, grows_towards_the_far_pole_of_a_ball_as_its_stereographic_map_does) {
  constexpr Index kSectors = 64;
  constexpr Index kRings = 64;
  const mesh::Surface ball = test::sphere(kSectors, kRings);
  std::vector<char> open(static_cast<std::size_t>(ball.vertices.rows()), 0);
  const double least = std::cos(8.5 * std::numbers::pi / kRings);
  VertexId far = 0;
  for (VertexId v = 0; v < ball.vertices.rows(); ++v) {
    open[static_cast<std::size_t>(v)] = ball.vertices(v, 2) > least ? 1 : 0;
    if (ball.vertices(v, 2) < ball.vertices(far, 2)) far = v;
  }
  ExecutionContext context;
  const std::vector<double> u = ScaleField(ball).solve(open, context);
  const double radius = 8.0 * std::numbers::pi / kRings;
  EXPECT_NEAR(u[static_cast<std::size_t>(far)], std::log(2.0 / (1.0 - std::cos(radius))), 0.1);
}

}  // namespace
}  // namespace flipfree::unwrap::scale_field_test
