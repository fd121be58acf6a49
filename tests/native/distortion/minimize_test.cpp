#include "flipfree/distortion/minimize/minimize.h"

#include <gtest/gtest.h>

#include <cmath>

#include "flipfree/base/error.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/minimize/boundary_barrier.h"
#include "support/shapes.h"

namespace flipfree::distortion::minimize_test {
namespace {

// The projection to the plane: flip-free for height fields.
Points2 plan(const mesh::Surface& surface) { return surface.vertices.leftCols<2>(); }

// Flip-free map of a grid with cells that shrink exponentially towards one side: ratio of scales
// `range`.
Points2 squeezed(const mesh::Surface& grid, double range) {
  Points2 uv = plan(grid);
  for (Eigen::Index v = 0; v < uv.rows(); ++v) {
    uv(v, 0) = std::pow(range, uv(v, 0));
    uv(v, 1) *= uv(v, 0);
  }
  return uv;
}

TEST(Minimize, TerribleStartsReachTheSameEnergyAsGoodOnes) {
  const mesh::Surface surface = test::bumpy_grid(24, 24, 0.3, 2);
  ExecutionContext context;
  MinimizeOptions options;
  options.tolerance = 1e-9;
  const Minimized good = minimize_distortion(surface, plan(surface), options, context);
  for (const double range : {1e-3, 1e-6, 1e-12}) {
    SCOPED_TRACE(range);
    Points2 start = squeezed(surface, range);
    ASSERT_TRUE(is_flip_free(surface.faces, start, context) ||
                (start.col(0) *= -1, is_flip_free(surface.faces, start, context)));
    const Minimized bad = minimize_distortion(surface, start, options, context);
    EXPECT_TRUE(is_flip_free(surface.faces, bad.uv, context));
    EXPECT_NEAR(bad.energy, good.energy, 1e-6);
  }
}

// A ramp that winds around an axis `turns` times, nearly flat: its isometric development is a ring
// that overlaps itself.
mesh::Surface ramp(Index length, Index width, double turns) {
  mesh::Surface surface = test::grid(length, width);
  for (Eigen::Index v = 0; v < surface.vertices.rows(); ++v) {
    const double angle = turns * 2 * std::acos(-1.0) * surface.vertices(v, 0);
    const double radius = 1.0 - 0.3 * surface.vertices(v, 1);
    surface.vertices.row(v) << radius * std::cos(angle), radius * std::sin(angle), 0.05 * angle;
  }
  return surface;
}

TEST(Minimize, AnOverlappingStartIsRefusedWhenTheMapIsToBeBijective) {
  const mesh::Surface surface = ramp(120, 6, 1.6);
  // The plan of the ramp covers part of the ring twice, without a flip.
  Points2 start = surface.vertices.leftCols<2>();
  ExecutionContext context;
  if (!is_flip_free(surface.faces, start, context)) start.col(0) *= -1;
  ASSERT_TRUE(is_flip_free(surface.faces, start, context));
  MinimizeOptions options;
  EXPECT_NO_THROW(minimize_distortion(surface, start, options, context));
  options.bijective = true;
  try {
    minimize_distortion(surface, start, options, context);
    FAIL() << "an overlapping start was accepted";
  } catch (const InvalidInput& e) {
    EXPECT_EQ(e.error().kind, ElementKind::kEdge);
    EXPECT_EQ(e.error().elements.size(), 4u);
  }
}

using Targets = std::vector<std::pair<VertexId, Vector2>>;

TEST(Minimize, UnreachableTargetsAreNamedAndBadOnesRefused) {
  const mesh::Surface surface = test::grid(10, 10);
  ExecutionContext context;
  const auto solve = [&](const Targets& targets) {
    return minimize_with_targets(surface, plan(surface), targets, {}, context);
  };
  // A triangle's corners in the wrong order.
  const TargetsResult result = solve({{60, {0.5, 0.5}}, {61, {0.5, 0.6}}, {72, {0.6, 0.5}}});
  EXPECT_TRUE(is_flip_free(surface.faces, result.uv, context));
  EXPECT_LT(result.fraction, 1.0);
  EXPECT_FALSE(result.missed.empty());
  EXPECT_THROW(solve({{3, {0, 0}}, {3, {1, 0}}}), InvalidInput);
  EXPECT_THROW(solve({{999, {0, 0}}}), InvalidInput);
  EXPECT_THROW(solve({{3, {std::nan(""), 0}}}), InvalidInput);
}

}  // namespace
}  // namespace flipfree::distortion::minimize_test
